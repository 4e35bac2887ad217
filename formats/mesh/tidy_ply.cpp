// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <vector>

#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/text_scan.h"
#include "formats/mesh/tidy.h"

namespace vps {
namespace {

struct Type {
  std::string_view name, other_name;
  std::size_t bytes;
  std::uint64_t largest;  ///< as the length of a list; 0: not an integer
};
constexpr Type kTypes[] = {{"char", "int8", 1, 0x7F},       {"uchar", "uint8", 1, 0xFF},
                           {"short", "int16", 2, 0x7FFF},   {"ushort", "uint16", 2, 0xFFFF},
                           {"int", "int32", 4, 0x7FFFFFFF}, {"uint", "uint32", 4, 0xFFFFFFFF},
                           {"float", "float32", 4, 0},      {"double", "float64", 8, 0}};

struct Property {
  std::string name;
  const Type* length = nullptr;  ///< of a list; null: a single number
  const Type* type = nullptr;
};

struct Element {
  std::string name;
  std::uint64_t items = 0;
  std::vector<Property> properties;

  [[nodiscard]] const Property* find(std::string_view wanted, bool list) const {
    for (const Property& p : properties) {
      if (p.name == wanted && (p.length != nullptr) == list) return &p;
    }
    return nullptr;
  }
};

struct PlyHeader {
  std::string format;
  std::vector<Element> elements;
  std::size_t end = 0;  ///< offset of the body
  std::size_t lines = 0;
  std::string special;  ///< what only assimp reads correctly; empty: nothing
};

const Type* find_type(std::string_view name, const LineScan& lines) {
  for (const Type& type : kTypes) {
    if (name == type.name || name == type.other_name) return &type;
  }
  throw ReadError(lines.place() + "unknown type " + in_quotes(name));
}

Element read_element(std::string_view rest, const LineScan& lines) {
  Element element;
  element.name = take_word(rest);
  const std::string_view word = take_word(rest);
  const auto items = to_integer(word);
  if (!items || *items < 0) throw ReadError(lines.place() + in_quotes(word) + " is no count");
  if (element.name == "tristrips") throw ReadError("the file stores triangle strips instead of faces");
  element.items = static_cast<std::uint64_t>(*items);
  return element;
}

Property read_property(std::string_view rest, const LineScan& lines) {
  Property property;
  std::string_view word = take_word(rest);
  if (word == "list") {
    word = take_word(rest);
    property.length = find_type(word, lines);
    if (property.length->largest == 0) throw ReadError(lines.place() + "the length of a list is no integer");
    word = take_word(rest);
  }
  property.type = find_type(word, lines);
  property.name = take_word(rest);
  return property;
}

PlyHeader read_header(LineScan& lines) {
  PlyHeader header;
  std::string_view rest;
  const auto next = [&] {
    if (!lines.next()) throw ReadError("the file ends inside its header");
    rest = lines.line();
    return take_word(rest);
  };
  if (next() != "ply" || !take_word(rest).empty()) throw ReadError("the file does not begin with 'ply'");
  for (std::string_view word = next(); word != "end_header"; word = next()) {
    if (word == "format") {
      header.format = take_word(rest);
    } else if (word == "element") {
      header.elements.push_back(read_element(rest, lines));
    } else if (word == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(read_property(rest, lines));
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      throw ReadError(lines.place() + "unexpected word " + in_quotes(word));
    }
  }
  if (header.format != "ascii" && header.format != "binary_little_endian" && header.format != "binary_big_endian")
    throw ReadError("unknown PLY format " + in_quotes(header.format));
  header.end = lines.end();
  header.lines = lines.number();
  return header;
}

const Property* face_corners(const Element& face) {
  const Property* const corners = face.find("vertex_indices", true);
  return corners != nullptr ? corners : face.find("vertex_index", true);
}

void check_vertex_element(const Element& vertex, PlyHeader& header) {
  for (const char* axis : {"x", "y", "z"}) {
    const Property* const p = vertex.find(axis, false);
    if (p == nullptr) throw ReadError(std::string("the vertices have no ") + axis);
    if (p->type->largest != 0) header.special = "its coordinates are integers";
  }
}

void check_face_element(const Element& face, PlyHeader& header) {
  const Property* const corners = face_corners(face);
  if (corners == nullptr) {
    if (face.items > 0) throw ReadError("the faces have no list vertex_indices");
    return;
  }
  if (corners->type->largest == 0) throw ReadError("the faces' vertex_indices are no integers");
  if (corners->type->bytes != 4) header.special = "its faces' indices are not of 32 bits";
}

void check_elements(PlyHeader& header, std::size_t body_bytes) {
  int vertices = 0, faces = 0, others = 0;
  const bool ascii = header.format == "ascii";
  for (const Element& element : header.elements) {
    std::size_t smallest = 0;
    for (const Property& p : element.properties) smallest += ascii ? 2 : (p.length ? p.length : p.type)->bytes;
    // Otherwise a header could promise any number of items that take no bytes.
    if (element.items > (smallest == 0 ? 0 : (body_bytes + 1) / smallest)) {
      throw ReadError("the header promises " + std::to_string(element.items) + " of element " +
                      in_quotes(element.name) + ", more than " + std::to_string(body_bytes) + " bytes can hold");
    }
    if (element.name == "vertex") {
      ++vertices;
      check_vertex_element(element, header);
    } else if (element.name == "face") {
      ++faces;
      check_face_element(element, header);
    } else {
      ++others;
    }
  }
  if (vertices != 1 || faces > 1) throw ReadError("the file needs one element 'vertex' and one element 'face'");
  // assimp reads the lists of other elements as faces.
  if (!header.special.empty() && others > 0)
    throw ReadError(header.special + ", which is not supported beside other elements");
}

void check_word(std::string_view word, const Type& type, const LineScan& lines) {
  if (type.largest == 0) {
    check_number(word, lines);
  } else if (!to_integer(word)) {
    throw ReadError(lines.place() + (word.empty() ? "a number is missing" : in_quotes(word) + " is no integer"));
  }
}

void check_text(const std::string& bytes, PlyHeader& header) {
  LineScan lines(std::string_view(bytes).substr(header.end));
  lines.set_number(header.lines);
  for (const Element& element : header.elements) {
    for (std::uint64_t i = 0; i < element.items; ++i) {
      if (!lines.next_with_content()) throw ReadError("the file ends before its last element");
      std::string_view rest = lines.line();
      for (const Property& p : element.properties) {
        std::uint64_t numbers = 1;
        if (p.length != nullptr) {
          const std::string_view word = take_word(rest);
          const auto length = to_integer(word);
          if (!length || *length < 0 || static_cast<std::uint64_t>(*length) > p.length->largest)
            throw ReadError(lines.place() + in_quotes(word) + " is no length of a list");
          numbers = static_cast<std::uint64_t>(*length);
        }
        for (; numbers > 0; --numbers) check_word(take_word(rest), *p.type, lines);
      }
      if (!take_word(rest).empty()) header.special = lines.place() + "more numbers than the header says";
    }
  }
  if (lines.next_with_content()) throw ReadError(lines.place() + "the file goes on after its last element");
}

/// Walks through the body of a binary file.
class Binary {
 public:
  Binary(std::string_view bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}
  void skip(std::uint64_t count, std::size_t size) {
    if (count > bytes_.size() / size) throw ReadError("the file ends before its last element");
    bytes_.remove_prefix(count * size);
  }
  std::uint64_t take_length(const Type& type) {
    const std::string_view at = bytes_;
    skip(1, type.bytes);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < type.bytes; ++i) {
      const auto byte = static_cast<unsigned char>(at[big_endian_ ? i : type.bytes - 1 - i]);
      value = value << 8 | byte;
    }
    if (value > type.largest) throw ReadError("a list has a negative length");
    return value;
  }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

void check_binary(const std::string& bytes, const PlyHeader& header) {
  Binary body(std::string_view(bytes).substr(header.end), header.format == "binary_big_endian");
  for (const Element& element : header.elements) {
    for (std::uint64_t i = 0; i < element.items; ++i) {
      for (const Property& p : element.properties) body.skip(p.length ? body.take_length(*p.length) : 1, p.type->bytes);
    }
  }
  if (std::any_of(body.rest().begin(), body.rest().end(), [](char c) { return !is_blank(c) && c != '\n'; }))
    throw ReadError("the file goes on after its last element");
}

// Only positions and corners keep their names, because CGAL fails on colours and half-edges of unusual types.
std::string plain_header(const PlyHeader& header) {
  std::string text = "ply\nformat " + header.format + " 1.0\n";
  for (const Element& element : header.elements) {
    const bool is_vertex = element.name == "vertex";
    const bool is_face = element.name == "face";
    text += "element " + std::string(is_vertex || is_face ? element.name : "other") + ' ' +
            std::to_string(element.items) + '\n';
    for (const Property& p : element.properties) {
      const bool position = is_vertex && !p.length && (p.name == "x" || p.name == "y" || p.name == "z");
      const bool corners = is_face && &p == face_corners(element);
      text += "property ";
      if (p.length != nullptr) text += "list " + std::string(p.length->name) + ' ';
      text += std::string(p.type->name) + ' ' + (position ? p.name : corners ? "vertex_indices" : "other") + '\n';
    }
  }
  return text + "end_header\n";
}

}  // namespace

void tidy_ply(std::string& bytes) {
  LineScan lines(bytes);
  PlyHeader header = read_header(lines);
  check_elements(header, bytes.size() - header.end);
  if (header.format == "ascii") {
    check_text(bytes, header);
  } else {
    check_binary(bytes, header);
  }
  if (!header.special.empty()) throw NeedsAssimp(header.special);
  bytes.replace(0, header.end, plain_header(header));
}

}  // namespace vps
