#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/world/terrain.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

inline constexpr float kTrackLane_m =
    1.7F;  ///< Distance between the middles of a lane and its track.
inline constexpr float kTrackHalf_m = 3.4F;   ///< Half of the worn width.
inline constexpr float kTrackClear_m = 4.2F;  ///< Nothing stands nearer to a track's middle.
inline constexpr float kCampHalfX_m = 92.0F;  ///< The fence.
inline constexpr float kCampHalfY_m = 66.0F;

/// A dirt track between two crossings, its middle line [m].
using Track = std::vector<Eigen::Vector2f>;

/// Tracks of a camp and their ground: crossings in 4 columns and 3 rows, winding tracks between
/// neighbours, six yards in between.
class CampPlan {
 public:
  explicit CampPlan(std::uint64_t seed);

  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }
  [[nodiscard]] const std::vector<Route>& routes() const { return routes_; }
  /// Yard in the middle of four crossings; column 0 .. 2, row 0 .. 1.
  [[nodiscard]] Eigen::Vector2f yard_center(int column, int row) const;

  /// Distance from the middle of the nearest track [m].
  [[nodiscard]] float distance_to_track(const Eigen::Vector2f& p) const;
  /// Height of the ground [m].
  [[nodiscard]] double ground(double x, double y) const;

  /// 0.5 m cells in and around the camp, 4 m cells beyond, with hills that close the view.
  [[nodiscard]] const Heightfield& near_ground() const { return near_; }
  [[nodiscard]] const Heightfield& far_ground() const { return far_; }

 private:
  void lay_tracks(std::uint64_t seed);
  void lay_routes();
  [[nodiscard]] const Track& track_between(int column, int row, bool along_x) const;
  [[nodiscard]] float height(float x, float y, std::uint64_t seed) const;

  std::array<std::array<Eigen::Vector2f, 3>, 4> crossings_;
  std::vector<Track> tracks_;  // first those along x, then those along y
  std::vector<Route> routes_;
  Heightfield far_;
  Heightfield near_;
};

}  // namespace km
