// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/peers.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "bake/quantity_text.h"
#include "cli/lab/bullet.h"
#include "cli/lab/fcl.h"
#include "cli/lab/hacd.h"

namespace vps::lab {
namespace {

// Bullet adds the margins of both hulls to every depth. This subtracts them again, as a user would.
class WithoutMargins final : public PairPeer {
 public:
  WithoutMargins(std::unique_ptr<PairPeer> peer, double margin) : peer_(std::move(peer)), margin_(margin) {}
  PairAnswer query(const Pose& first_in_second) override {
    PairAnswer answer = peer_->query(first_in_second);
    answer.depth -= 2 * margin_;
    return answer;
  }

 private:
  std::unique_ptr<PairPeer> peer_;
  const double margin_;
};

class PeerMaker {
 public:
  PeerMaker(const TriangleMesh& body, const PeerOptions& options) : body_(body), options_(options) {}

  Peers run() {
    for (const std::string& name : options_.without) out_.left_out.push_back({name, "left out by an option"});
    if (wanted("hull")) {
      add_hulls("hull", "hull of 42", "Bullet's btShapeHull, convex, at most 42 vertices",
                [this](double margin) { return hull_of_42(body_, margin); });
    }
    if (wanted("hacd")) {
      HacdOptions hacd;
      hacd.announce = options_.announce_hacd;
      const auto hulls = std::make_shared<std::vector<Hull>>(hacd_hulls(body_, hacd, options_.folder));
      add_hulls("hacd", "HACD", fmt::format("{} convex hulls of at most 100 vertices, concavity 100", hulls->size()),
                [hulls](double margin) {
                  return compound_of(*hulls, {0, 0, 0}, margin);
                });
    }
    if (wanted("gimpact")) {
      const auto shape = std::make_shared<BulletShape>(gimpact_of(body_, options_.margin));
      add("gimpact", "GImpact",
          fmt::format("Bullet's triangles against triangles, margin {}", bake::format_length(options_.margin)),
          [shape] { return bullet_pair(*shape); });
      out_.peers.back().shape = shape;
      out_.peers.back().depth_of = DepthOf::triangles;
    }
    if (wanted("fcl")) {
      const auto mesh = std::make_shared<const TriangleMesh>(body_);
      add("fcl", "FCL",
          "triangles in boxes of type OBBRSS; all contacts of all pairs of triangles. Its distances are the truth "
          "here: "
          "timed, but without an error",
          [mesh] { return fcl_collide(*mesh); });
      Peer& fcl = out_.peers.back();
      fcl.way = Way::query;
      fcl.depth_of = DepthOf::triangles;
      fcl.distance = {"FCL", [mesh] { return fcl_distance(*mesh); }};
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool wanted(const std::string& name) const {
    return std::find(options_.without.begin(), options_.without.end(), name) == options_.without.end();
  }
  void add(const std::string& name, const std::string& series, const std::string& remark,
           std::function<std::unique_ptr<PairPeer>()> make) {
    out_.peers.push_back({name, series, remark, Way::bullet, DepthOf::hulls, {series, std::move(make)}, {}, {}});
  }
  // Adds hulls without and with a margin: Bullet mostly uses GJK with margins, and EPA without.
  template <class Make>
  void add_hulls(const std::string& name, const std::string& series, const std::string& remark, Make shape_with) {
    for (const double margin : {0.0, options_.margin}) {
      const auto shape = std::make_shared<BulletShape>(shape_with(margin));
      if (const std::string why = hull_refusal(*shape); !why.empty()) {
        out_.left_out.push_back({name, why});
        return;
      }
      const std::string with = margin > 0 ? "margin " + bake::format_length(margin) : "no margin";
      add(name, series + ", " + with, remark + "; " + with + (margin > 0 ? ", twice that taken off every depth" : ""),
          [shape, margin] { return std::make_unique<WithoutMargins>(bullet_pair(*shape), margin); });
      out_.peers.back().shape = shape;
    }
  }

  const TriangleMesh& body_;
  const PeerOptions& options_;
  Peers out_;
};

}  // namespace

const std::vector<std::string>& peer_names() {
  static const std::vector<std::string> names = {"hull", "hacd", "gimpact", "fcl"};
  return names;
}

Peers make_peers(const TriangleMesh& body, const PeerOptions& options) {
  return PeerMaker(body, options).run();
}

}  // namespace vps::lab
