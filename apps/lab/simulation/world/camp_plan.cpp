#include "apps/lab/simulation/world/camp_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;

constexpr int kTrackColumns = 4;
constexpr int kTrackRows = 3;
constexpr float kPitchX_m = 50.0F;
constexpr float kPitchY_m = 46.0F;
constexpr int kTrackPieces = 6;  // pieces of a track
constexpr double kTrackSpeed_mps = 7.5;

constexpr float kNearCell_m = 0.5F;
constexpr float kFarCell_m = 4.0F;
const Vector2f kNearOrigin(-100.0F, -76.0F);
const Vector2f kFarOrigin(-180.0F, -156.0F);

float distance_to_segment(const Vector2f& p, const Vector2f& a, const Vector2f& b) {
  const Vector2f ab = b - a;
  const float share = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0F, 1.0F);
  return (p - a - share * ab).norm();
}

}  // namespace

CampPlan::CampPlan(std::uint64_t seed)
    : far_(kFarOrigin, kFarCell_m, 1, 1, [](float, float) { return 0.0F; }), near_(far_) {
  lay_tracks(seed);
  lay_routes();
  const auto sample = [&](float x, float y) { return height(x, y, seed); };
  far_ = Heightfield(kFarOrigin, kFarCell_m, 90, 78, sample);
  near_ = Heightfield(kNearOrigin, kNearCell_m, 400, 304, sample);
  // The border of the fine grid is set to the coarse one, so that there is no gap.
  const auto settle = [&](int row, int column) {
    const Eigen::Vector3f p = near_.point(row, column);
    near_.set_height(row, column, static_cast<float>(far_.at(p.x(), p.y())));
  };
  for (int row = 0; row <= near_.rows(); ++row) {
    settle(row, 0);
    settle(row, near_.columns());
  }
  for (int column = 0; column <= near_.columns(); ++column) {
    settle(0, column);
    settle(near_.rows(), column);
  }
}

void CampPlan::lay_tracks(std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 50);
  for (int i = 0; i < kTrackColumns; ++i) {
    for (int j = 0; j < kTrackRows; ++j) {
      const float x = kPitchX_m * (static_cast<float>(i) - 1.5F) + random.uniform(-3.0F, 3.0F);
      const float y = kPitchY_m * (static_cast<float>(j) - 1.0F) + random.uniform(-3.0F, 3.0F);
      crossings_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = {x, y};
    }
  }
  const auto wind = [&](const Vector2f& a, const Vector2f& b) {
    const Vector2f across = Vector2f(a.y() - b.y(), b.x() - a.x()).normalized();
    const float bow = random.uniform(-2.2F, 2.2F);
    const float sway = random.uniform(-1.2F, 1.2F);
    Track track;
    for (float k = 0; k <= kTrackPieces; ++k) {
      const float t = k / kTrackPieces;
      const float phase = std::numbers::pi_v<float> * t;
      track.emplace_back(a + t * (b - a) +
                         (bow * std::sin(phase) + sway * std::sin(2.0F * phase)) * across);
    }
    tracks_.push_back(std::move(track));
  };
  for (std::size_t i = 0; i + 1 < kTrackColumns; ++i)
    for (std::size_t j = 0; j < kTrackRows; ++j) wind(crossings_[i][j], crossings_[i + 1][j]);
  for (std::size_t i = 0; i < kTrackColumns; ++i)
    for (std::size_t j = 0; j + 1 < kTrackRows; ++j) wind(crossings_[i][j], crossings_[i][j + 1]);
}

const Track& CampPlan::track_between(int column, int row, bool along_x) const {
  const int index = along_x ? column * kTrackRows + row
                            : (kTrackColumns - 1) * kTrackRows + column * (kTrackRows - 1) + row;
  return tracks_[static_cast<std::size_t>(index)];
}

void CampPlan::lay_routes() {
  for (const std::vector<Crossing>& crossings : crossing_routes()) {
    std::vector<Eigen::Vector2d> nodes;
    for (std::size_t k = 0; k < crossings.size(); ++k) {
      const auto& [i0, j0] = crossings[k];
      const auto& [i1, j1] = crossings[(k + 1) % crossings.size()];
      const Track& track = track_between(std::min(i0, i1), std::min(j0, j1), j0 == j1);
      const bool forward = i1 > i0 || j1 > j0;
      for (int piece = 0; piece < kTrackPieces; ++piece) {
        const int at = forward ? piece : kTrackPieces - piece;
        nodes.emplace_back(track[static_cast<std::size_t>(at)].cast<double>());
      }
    }
    std::ranges::rotate(nodes, nodes.begin() + kTrackPieces / 2);  // start between two crossings
    routes_.push_back({right_hand_lane(nodes, kTrackLane_m), kTrackSpeed_mps});
  }
}

Vector2f CampPlan::yard_center(int column, int row) const {
  const auto i = static_cast<std::size_t>(column);
  const auto j = static_cast<std::size_t>(row);
  return 0.25F * (crossings_[i][j] + crossings_[i + 1][j] + crossings_[i][j + 1] +
                  crossings_[i + 1][j + 1]);
}

float CampPlan::distance_to_track(const Vector2f& p) const {
  float least = std::numeric_limits<float>::infinity();
  for (const Track& track : tracks_)
    for (std::size_t i = 0; i + 1 < track.size(); ++i)
      least = std::min(least, distance_to_segment(p, track[i], track[i + 1]));
  return least;
}

double CampPlan::ground(double x, double y) const {
  return near_.contains(x, y) ? near_.at(x, y) : far_.at(x, y);
}

float CampPlan::height(float x, float y, std::uint64_t seed) const {
  const float waves =
      1.3F * ground_noise(x, y, 46.0F, seed) + 0.35F * ground_noise(x, y, 17.0F, seed + 1);
  const float outside =
      std::max({std::abs(x) - kCampHalfX_m - 6.0F, std::abs(y) - kCampHalfY_m - 6.0F, 0.0F});
  const float hills = smooth_step(0.0F, 60.0F, outside) *
                      (9.0F + 5.0F * ground_noise(x, y, 38.0F, seed + 2) + 0.05F * outside);
  const float track = distance_to_track({x, y});
  const float wild = smooth_step(kTrackHalf_m - 0.6F, kTrackHalf_m + 2.0F, track);
  const float bumps =
      0.1F * ground_noise(x, y, 3.7F, seed + 3) + 0.06F * ground_noise(x, y, 1.5F, seed + 4);
  // Worn tracks lie deeper, with ruts where the wheels of both lanes run.
  const float rut = std::abs(std::abs(track - kTrackLane_m) - 0.75F);
  const float worn = -0.1F - 0.05F * (1.0F - smooth_step(0.0F, 0.45F, rut)) +
                     0.03F * ground_noise(x, y, 2.1F, seed + 5) +
                     0.015F * ground_noise(x, y, 0.9F, seed + 6);
  return waves + hills + wild * bumps + (1.0F - wild) * worn;
}

}  // namespace km
