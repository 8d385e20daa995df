#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/mesh/mesh_chunks.hpp"
#include "modules/surface_ties/rigid_pieces.hpp"
#include "modules/surface_ties/surface_tie.hpp"

namespace km {

/// Finds ties between the surfaces of this robot and those of robots with higher ids, and between
/// two visits of this robot. A tie is a closure between two keyframes, which the back-end judges
/// like any other one.
///
/// No information counts twice. A tie whose keyframes are both within kNear keyframes of those of a
/// closure would be at the place of that closure, and is not made. A stretch of kApart keyframes of
/// a robot takes part in one tie per robot pair. Inside the robot, it is the earlier end of at most
/// one tie and the later end of at most one, so that ties form chains without cycles. No tie is
/// made with a robot whose relative pose is tentative, because a tie begins with that pose and
/// cannot confirm it.
///
/// Inside the robot, only surfaces of two visits are laid on each other. The position by the tie
/// has a smaller variance than that by odometry. Otherwise odometry has drifted by less than the
/// noise of the surfaces, and the tie would add little beside the errors that both share.
///
/// Not thread-safe. The result depends on the order of the calls.
class TieSearch {
 public:
  static constexpr KeyframeIndex kNear = 10;  ///< As in ClosurePlaces.
  static constexpr KeyframeIndex kApart = RigidPieces::kLength;
  static constexpr double kCalm_s = 2.0;  ///< Time without changes after which a piece is used.

  /// Largest standard deviation of the position of a tie. Smaller than the errors of most closures,
  /// and than the distance by which a person sees two walls in place of one.
  static constexpr double kMaxSigma_m = 0.05;

  /// `max_gap_keyframes` is the largest keyframe_gap() within one visit, as in
  /// MeshDeformationConfig::time_window_keyframes.
  TieSearch(RobotId self, KeyframeIndex max_gap_keyframes, const SurfaceTieOptions& options = {});

  /// A keyframe of this robot. Precedes the chunks that it moves.
  void learn(const OdometryPose& keyframe);
  /// A chunk of this robot or a received one. Precondition: fault_of() finds no fault.
  void add(const MeshChunk& chunk, double now_s);
  /// Present poses of this robot or received ones.
  void add(const MeshPoses& poses, double now_s);
  /// Any closure, also ties of a former process.
  void add(const ClosureId& closure);
  /// Discards everything about a restarted robot.
  void forget(RobotId robot);
  /// Robots whose pose relative to this one is known, and not tentative. This robot is one of them
  /// if the relative poses of all its keyframes are known.
  void set_joined(std::vector<RobotId> robots);

  /// At most one registration, and the tie to which the registrations so far lead, if any.
  [[nodiscard]] std::optional<Closure> step(double now_s);

  /// True if step() has nothing left to do with the present chunks, also later. After a change, it
  /// is false until the next step().
  [[nodiscard]] bool is_done() const { return is_done_; }

 private:
  // `inside` stands for the pairs inside this robot, in contrast to those between robots.

  // Pieces of this robot and of another one, by their numbers. Inside this robot, `other` is this
  // robot, and `own` < `peer`.
  struct Pair {
    RobotId other = 0;
    KeyframeIndex own = 0, peer = 0;
    auto operator<=>(const Pair&) const = default;
  };
  struct Version {
    std::uint64_t number = 0;
    double changed_s = 0.0;
  };
  using PieceId = std::pair<RobotId, KeyframeIndex>;

  template <typename Message>
  void add_to_pieces(RobotId robot, std::uint64_t boot, const Message& message, double now_s);
  RigidPieces& pieces_of(RobotId robot);
  [[nodiscard]] bool is_joined(RobotId robot) const;
  [[nodiscard]] std::vector<Pair> open_pairs(bool inside) const;
  void add_open_pairs(RobotId robot, const RigidPieces& pieces, std::vector<Pair>& pairs) const;
  [[nodiscard]] bool is_open(const Pair& pair) const;
  [[nodiscard]] bool is_calm(const Pair& pair, double now_s) const;
  [[nodiscard]] std::uint64_t version_of(const Pair& pair) const;
  [[nodiscard]] std::optional<Closure> lay(const Pair& pair);
  [[nodiscard]] bool is_tied(const ClosureId& tie) const;
  [[nodiscard]] std::optional<Closure> take_best(bool inside);

  const RobotId self_;
  const KeyframeIndex max_gap_keyframes_;
  const SurfaceTieOptions options_;
  std::map<RobotId, RigidPieces> pieces_;
  std::map<RobotId, std::uint64_t> boots_;
  std::map<PieceId, Version> versions_;
  std::uint64_t changes_ = 0;
  std::map<Pair, std::uint64_t> tried_;  // version_of() at the last registration
  std::map<Pair, Closure> found_;        // not yet taken
  std::set<ClosureId> closures_, ties_;
  std::vector<RobotId> joined_;
  bool is_done_ = true;
};

}  // namespace km
