#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/mesh/coarse_view.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A vertex that views may see through.
struct SightPoint {
  Eigen::Vector3f position;    ///< In the frame of the views' poses [m].
  std::int64_t last_seen = 0;  ///< Only later views count.
  std::uint32_t pose = 0;      ///< Index of the pose from which it was mapped.
};

/// Counts the views that see through the vertices of a mesh.
///
/// A vertex starts with count 0. A later view that sees through it (see sight_of()) adds one, at
/// most once per keyframe. A view that shows surface there takes one away, but not below 0. The
/// surface is gone if the count ends at the configured number of views or above.
///
/// The count is the log-odds of occupancy. It is clamped where surface is certain, as in Hornung et
/// al., "OctoMap: An Efficient Probabilistic 3D Mapping Framework Based on Octrees" (Autonomous
/// Robots, 2013), with steps of equal size. The sensor model states that a view seems to see
/// through a present surface with probability 0.15. It sees through free space with 0.9. Both allow
/// for errors of poses and depths that neighbouring views have in common. A step is log(0.9 / 0.15)
/// = 1.8. From the upper clamp of OctoMap's source, 3.5 (probability 0.97), three steps lead to
/// -1.9, near its lower clamp of -2.
class SightVotes {
 public:
  /// `patch_m`: radius of the surface that a vertex stands for.
  SightVotes(const std::vector<SightPoint>& points, double patch_m);

  /// Adds a view at `time`. Call in order of time. `sigmas`: of the view's pose relative to each
  /// pose of the points; empty: nothing is judged.
  void add(const CoarseView& view, const SE3& T_world_cam, std::int64_t time,
           std::span<const PoseSigma> sigmas);

  /// For each point, whether at least `views` views see through it.
  [[nodiscard]] std::vector<bool> seen_through(int views) const;

 private:
  // Points of one cell of a grid, within a sphere.
  struct Group {
    Eigen::Vector3f center = Eigen::Vector3f::Zero();
    float radius_m = 0.0F;
    std::int64_t first_seen = 0;  // earliest SightPoint::last_seen
    std::size_t begin = 0, end = 0;
  };
  struct Vote {
    std::uint32_t last_keyframe = 0;
    std::uint16_t count = 0;
  };

  void make_groups();
  void vote(const CoarseView& view, std::size_t place, Sight sight);

  float patch_m_;
  std::vector<SightPoint> points_;    // by group
  std::vector<std::uint32_t> order_;  // index of each point in the list of the caller
  std::vector<Group> groups_;
  std::vector<Vote> votes_;
};

/// Standard deviations of the pose of keyframe `of` relative to each keyframe, from the covariances
/// of all of them in one frame. Errors of odometry add up along its chain. Two poses therefore
/// share the error of the most certain keyframe between them: s^2 = s_i^2 + s_j^2 - 2 min s_k^2 for
/// k from i to j. This is exact for odometry, and an estimate where closures tie distant keyframes.
/// Precondition: `of` is below the number of covariances.
[[nodiscard]] std::vector<PoseSigma> relative_sigmas(std::span<const Matrix6> covariances,
                                                     std::size_t of);

/// Removes the faces with at least two corners that are seen through. One corner does not suffice,
/// so that the border of other surface stays. Vertices that then have no face are removed too.
/// Returns the vertices that stay, as ascending indices. Precondition: every vertex has a face.
std::vector<std::uint32_t> remove_seen_through(LabelledMesh& mesh,
                                               const std::vector<bool>& seen_through);

}  // namespace km
