// Shared by the pages with a three-dimensional view: the view itself, its labels, arrays, lengths, colours.
'use strict';

// Typed array from base64, little-endian.
function unpack(text, Type) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return new Type(bytes.buffer);
}

// The unit in which a length of this size is read best.
function lengthUnit(metres) {
  const size = Math.abs(metres);
  const [scale, name] = size >= 1e3 ? [1e-3, 'km'] : size >= 1 ? [1, 'm'] : size >= 1e-3 ? [1e3, 'mm']
      : [1e6, 'µm'];
  return {name, number: (length, digits = 3) => `${+(length * scale).toPrecision(digits)}`.replace('-', '−')};
}
function lengthText(metres, digits) {
  const unit = lengthUnit(metres);
  return metres === 0 ? '0' : `${unit.number(metres, digits)} ${unit.name}`;
}

// The text with typographic units and signs.
const tidyText = text => text.replace(/(\d) um\b/g, '$1 µm').replace(/ x /g, ' × ');
const countText = n => n.toLocaleString('en');

// 1, 2 or 5 times a power of ten, no more than x.
function niceLength(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * (x / power >= 5 ? 5 : x / power >= 2 ? 2 : 1);
}

// Colour between stops that are equally far apart. t in [0, 1]; returns [r, g, b] in 0 to 255.
function mixStops(stops, t) {
  const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2);
  return stops[i].map((low, k) => low + (at - i) * (stops[i + 1][k] - low));
}
// Outside blue, surface white, inside red: distinct with every common colour blindness.
const kDiverging = [[33, 102, 172], [146, 197, 222], [247, 247, 247], [244, 165, 130], [178, 24, 43]];
const kSequential = [[253, 200, 39], [237, 121, 83], [189, 55, 134], [128, 40, 190], [70, 84, 214]];
const kErrors = [[205, 212, 220], [253, 200, 39], [213, 94, 0], [120, 20, 60]];
const cssColour = c => `rgb(${c.map(Math.round).join(',')})`;

// A ramp of colours with ticks: [place from 0 to 1, text] each.
function showRamp(holder, colours, ticks) {
  holder.innerHTML = '<i></i><div></div>';
  holder.firstChild.style.background = `linear-gradient(to right, ${colours})`;
  for (const [at, text] of ticks) {
    const tick = document.createElement('span');
    tick.style.left = `${100 * at}%`;
    tick.textContent = text;
    holder.lastChild.append(tick);
  }
}
const threeColour = c => new THREE.Color(c[0] / 255, c[1] / 255, c[2] / 255);

function textSprite(text, height) {
  const canvas = document.createElement('canvas');
  const pen = canvas.getContext('2d');
  const font = '48px system-ui, sans-serif';
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(text).width) + 24;
  canvas.height = 64;
  pen.font = font;
  pen.textBaseline = 'middle';
  pen.lineJoin = 'round';
  pen.lineWidth = 9;
  pen.strokeStyle = getComputedStyle(document.body).backgroundColor;
  pen.fillStyle = getComputedStyle(document.body).color;
  pen.strokeText(text, 12, 34);
  pen.fillText(text, 12, 34);
  const texture = new THREE.CanvasTexture(canvas);
  texture.minFilter = THREE.LinearFilter;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, depthTest: false}));
  sprite.scale.set(height * canvas.width / canvas.height, height, 1);
  sprite.renderOrder = 10;
  return sprite;
}

// A view of a scene that fills `holder`, painted only when something changed.
class View {
  // margin: how much larger than the box the picture is.
  constructor(holder, low, high, up, margin) {
    this.margin = margin;
    this.labels = [];
    this.holder = holder;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35);
    this.frame(low, high);
    this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'img');
    this.canvas.style.touchAction = 'none';
    holder.prepend(this.canvas);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x777788, 0.75));
    this.light = new THREE.DirectionalLight(0xffffff, 0.5);
    this.scene.add(this.light, this.light.target);
    const below = document.createElement('div');
    below.className = 'below';
    below.innerHTML = '<span class="scale"><i></i><span></span></span>' +
        '<span class="soft">Drag: turn. Wheel or pinch: zoom. Right-drag or two fingers: shift.</span>';
    this.bar = below.firstChild;
    holder.after(below);
    this.setUp(up);
    this.canvas.addEventListener('keydown', event => this.onKey(event));
    new ResizeObserver(() => this.resize()).observe(holder);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => location.reload());
    this.resize();
  }

  // Sets the box that the next call of `look` fits into the picture.
  frame(low, high) {
    this.low = new THREE.Vector3(...low);
    this.high = new THREE.Vector3(...high);
    this.size = this.high.distanceTo(this.low);
    Object.assign(this.camera, {near: this.size / 200, far: this.size * 200});
    this.camera.updateProjectionMatrix();
  }

  setUp(up) {
    if (this.controls) this.controls.dispose();
    this.up = up;
    this.camera.up.set(up === 'x' ? 1 : 0, up === 'y' ? 1 : 0, up === 'z' ? 1 : 0);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.enableKeys = false;
    // Paints after every update: OrbitControls reports only changes of a millimetre or more.
    const update = this.controls.update;
    this.controls.update = () => { update(); this.paint(); };
    this.controls.addEventListener('start', () => this.moved = true);
    this.look({x: [0.2, 0.3, 1], y: [0.5, 0.35, 1], z: [0.55, -1, 0.4]}[up]);
  }

  // Looks from this side and fits the whole box into the picture, with room for labels.
  look(from) {
    this.from = from;
    this.moved = false;
    const {low, high, camera} = this;
    const centre = low.clone().add(high).multiplyScalar(0.5);
    const back = new THREE.Vector3(...from).normalize();
    const right = new THREE.Vector3().crossVectors(camera.up, back).normalize();
    const up = new THREE.Vector3().crossVectors(back, right);
    const tangent = Math.tan(camera.fov * Math.PI / 360) / this.margin;
    let distance = 0;
    const fit = (place, room) => {
      const p = place.clone().sub(centre);
      distance = Math.max(distance, p.dot(back) + (Math.abs(p.dot(up)) + 0.8 * room) / tangent,
          p.dot(back) + (Math.abs(p.dot(right)) + room) / (tangent * camera.aspect));
    };
    for (let corner = 0; corner < 8; ++corner)
      fit(new THREE.Vector3(...[0, 1, 2].map(k => (corner >> k & 1 ? high : low).getComponent(k))), 0);
    for (const label of this.labels) fit(label.position, label.scale.x / 2);
    Object.assign(this.controls, {minDistance: this.size / 50, maxDistance: this.size * 20});
    this.controls.target.copy(centre);
    camera.position.copy(centre).addScaledVector(back, distance);
    this.controls.update();
  }

  onKey(event) {
    const turn = {ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[event.key];
    const zoom = {'+': 0.9, '=': 0.9, '-': 1 / 0.9}[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    this.moved = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const toY = new THREE.Quaternion().setFromUnitVectors(this.camera.up, new THREE.Vector3(0, 1, 0));
    const around = new THREE.Spherical().setFromVector3(offset.applyQuaternion(toY));
    if (turn) {
      around.theta += turn[0];
      around.phi = Math.min(Math.max(around.phi + turn[1], 0.02), Math.PI - 0.02);
    } else {
      around.radius *= zoom;
    }
    offset.setFromSpherical(around).applyQuaternion(toY.inverse());
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.holder;
    if (width === 0 || height === 0) return;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height);
    if (!this.moved) this.look(this.from);
    this.paint();
  }

  paint() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.beforePaint) this.beforePaint();
      this.light.position.copy(this.camera.position);
      this.light.target.position.copy(this.controls.target);
      this.renderer.render(this.scene, this.camera);
      const distance = this.camera.position.distanceTo(this.controls.target);
      const perPixel = 2 * distance * Math.tan(this.camera.fov * Math.PI / 360) / this.holder.clientHeight;
      const length = niceLength(130 * perPixel);
      this.bar.firstChild.style.width = `${length / perPixel}px`;
      this.bar.lastChild.textContent = `${lengthText(length)} (at the middle)`;
    });
  }

  // Adds the bounding box with its lengths, and the axes at its lowest corner.
  addFrame(colour) {
    const {low, high, size} = this;
    const box = new THREE.Box3Helper(new THREE.Box3(low, high), colour);
    box.material.transparent = true;
    box.material.opacity = 0.35;
    this.scene.add(box);
    const axes = [['x', 0xd55e00], ['y', 0x009e73], ['z', 0x0072b2]];  // Okabe and Ito: safe for the colour-blind
    for (const [i, [name, axisColour]] of axes.entries()) {
      const direction = new THREE.Vector3().setComponent(i, 1);
      const reach = Math.max(high.getComponent(i) - low.getComponent(i), 0.1 * size);
      // Made with length 1 and scaled: ArrowHelper draws none shorter than a tenth of a millimetre.
      const length = reach * 1.12;
      const arrow = new THREE.ArrowHelper(direction, low, 1, axisColour, 0.04 * size / length, 0.02 * size / length);
      arrow.scale.setScalar(length);
      this.scene.add(arrow);
      const label = textSprite(`${name} ${lengthText(high.getComponent(i) - low.getComponent(i))}`, 0.045 * size);
      label.position.copy(low).addScaledVector(direction, reach * 1.12 + 0.075 * size);
      this.scene.add(label);
      this.labels.push(label);
    }
    this.setUp(this.up);
  }
}

// A round dot for points.
function dotTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 32;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#fff';
  pen.arc(16, 16, 15, 0, 7);
  pen.fill();
  return new THREE.CanvasTexture(canvas);
}

// Triangles whose positions are codes: origin + step * code. A corner has the mean normal of those triangles around it
// that lean by less than 30 degrees against its own, so that edges look sharp and curved faces smooth.
function unpackSurface(data) {
  const codes = unpack(data.positions, Uint16Array), triangles = unpack(data.triangles, Uint32Array);
  const at = new Float32Array(codes.length);
  for (let i = 0; i < codes.length; ++i) at[i] = data.origin[i % 3] + data.step * codes[i];
  const count = triangles.length / 3, vertices = at.length / 3;
  const areas = new Float64Array(triangles.length), units = new Float32Array(triangles.length);
  for (let t = 0; t < count; ++t) {
    const [a, b, c] = [0, 1, 2].map(i => 3 * triangles[3 * t + i]);
    const u = [0, 1, 2].map(k => (at[b + k] - at[a + k]) / data.step), v = [0, 1, 2].map(k => (at[c + k] - at[a + k]) / data.step);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]], length = Math.hypot(...n) || 1;
    for (let k = 0; k < 3; ++k) { areas[3 * t + k] = n[k]; units[3 * t + k] = n[k] / length; }
  }
  // The triangles around each vertex.
  const first = new Uint32Array(vertices + 1), around = new Uint32Array(triangles.length);
  for (const v of triangles) ++first[v + 1];
  for (let v = 0; v < vertices; ++v) first[v + 1] += first[v];
  const next = first.slice();
  triangles.forEach((v, i) => { around[next[v]++] = Math.floor(i / 3); });
  const positions = new Float32Array(3 * triangles.length), normals = new Float32Array(3 * triangles.length);
  for (let i = 0; i < triangles.length; ++i) {
    const v = triangles[i], own = 3 * Math.floor(i / 3);
    let x = 0, y = 0, z = 0;
    for (let j = first[v]; j < first[v + 1]; ++j) {
      const t = 3 * around[j];
      if (units[t] * units[own] + units[t + 1] * units[own + 1] + units[t + 2] * units[own + 2] < 0.866) continue;
      x += areas[t]; y += areas[t + 1]; z += areas[t + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * i);
    positions.set([at[3 * v], at[3 * v + 1], at[3 * v + 2]], 3 * i);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  if (data.errors) {
    const errors = unpack(data.errors, Uint8Array), colours = new Float32Array(3 * triangles.length);
    const ramp = Array.from({length: 256}, (_, i) => mixStops(kErrors, i / 255).map(c => c / 255));
    triangles.forEach((v, i) => colours.set(ramp[errors[v]], 3 * i));
    geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
  }
  return geometry;
}

// Whether WebGL works. Where it does not, a message takes the view's place.
function canShow(holder) {
  try {
    const canvas = document.createElement('canvas');
    if (canvas.getContext('webgl2') || canvas.getContext('webgl')) return true;
  } catch (error) { /* no WebGL */ }
  holder.innerHTML = '<p class="none">This browser shows no three-dimensional graphics (WebGL): switch on hardware ' +
      'acceleration, or read the numbers here.</p>';
  return false;
}
