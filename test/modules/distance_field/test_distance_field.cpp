#include "modules/distance_field/distance_field.hpp"

#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kVoxel_m = 0.1;

using Voxel = std::array<int, 3>;

// A world of voxels, from which blocks are reported as the mapper does.
class World {
 public:
  explicit World(int blocks) : blocks_(blocks), side_(blocks * kBlockSide) {}

  std::set<Voxel> inside, unobserved;

  [[nodiscard]] int side() const { return side_; }
  [[nodiscard]] bool is_observed(const Voxel& v) const {
    for (const int c : v)
      if (c < 0 || c >= side_) return false;
    return !unobserved.contains(v);
  }

  [[nodiscard]] BlockSpace block(const Eigen::Vector3i& position) const {
    BlockSpace space{.position = position};
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y)
        for (int x = 0; x < kBlockSide; ++x) {
          const Voxel v = {8 * position.x() + x, 8 * position.y() + y, 8 * position.z() + z};
          const std::uint64_t bit = std::uint64_t{1} << (x + 8 * y);
          if (is_observed(v)) space.observed[static_cast<std::size_t>(z)] |= bit;
          if (inside.contains(v)) space.inside[static_cast<std::size_t>(z)] |= bit;
        }
    return space;
  }

  [[nodiscard]] SpaceChanges all() const {
    SpaceChanges changes;
    for (int z = 0; z < blocks_; ++z)
      for (int y = 0; y < blocks_; ++y)
        for (int x = 0; x < blocks_; ++x) changes.push_back(block({x, y, z}));
    return changes;
  }

  // Distance of a voxel by comparing it with all surface voxels [m].
  [[nodiscard]] std::vector<Voxel> surface() const {
    std::vector<Voxel> found;
    for (const Voxel& v : inside) {
      if (!is_observed(v)) continue;
      bool is_surface = false;
      for (std::size_t k = 0; k < 3; ++k)
        for (const int step : {-1, 1}) {
          Voxel next = v;
          next[k] += step;
          is_surface |= is_observed(next) && !inside.contains(next);
        }
      if (is_surface) found.push_back(v);
    }
    return found;
  }

 private:
  int blocks_, side_;
};

// Distances of a slice by the x and y of their voxels.
std::map<std::array<int, 2>, double> slice_of(const DistanceField& field, int z) {
  std::map<std::array<int, 2>, double> distances;
  for (const auto& [point, distance_m] : field.slice(kVoxel_m * z)) {
    const Eigen::Vector3i voxel =
        (point / static_cast<float>(kVoxel_m)).array().round().cast<int>();
    CHECK(voxel.z() == z);
    distances[{voxel.x(), voxel.y()}] = static_cast<double>(distance_m);
  }
  return distances;
}

std::optional<double> distance_at(const DistanceField& field, const Voxel& voxel) {
  const auto slice = slice_of(field, voxel[2]);
  const auto found = slice.find({voxel[0], voxel[1]});
  return found == slice.end() ? std::nullopt : std::optional(found->second);
}

// Compares all voxels with brute force; returns how many were known.
std::size_t check_all(const World& world, const DistanceField& field) {
  const std::vector<Voxel> surface = world.surface();
  std::size_t known = 0, wrong = 0;
  for (int z = -1; z <= world.side(); ++z) {
    const std::map<std::array<int, 2>, double> slice = slice_of(field, z);
    for (int y = -1; y <= world.side(); ++y)
      for (int x = -1; x <= world.side(); ++x) {
        const Voxel v = {x, y, z};
        const auto distance = slice.find({x, y});
        if ((distance != slice.end()) != world.is_observed(v)) ++wrong;
        if (distance == slice.end()) continue;
        ++known;
        double nearest = std::numeric_limits<double>::infinity();
        for (const Voxel& s : surface)
          nearest = std::min(nearest, std::hypot(x - s[0], y - s[1], z - s[2]));
        const double truth = world.inside.contains(v) ? -(nearest + 0.5) : nearest - 0.5;
        const double most = field.max_distance_m();
        if (std::abs(std::clamp(kVoxel_m * truth, -most, most) - distance->second) > 1e-6) ++wrong;
      }
  }
  CHECK(wrong == 0);
  return known;
}

TEST_CASE("Distances equal brute force while obstacles come and go") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  World world(3);
  std::uniform_int_distribution<int> any(0, world.side() - 1);
  const double max_distance_m = seed == 1 ? 0.55 : 1.2;
  DistanceField field(max_distance_m, kVoxel_m);
  field.set(world.all());
  CHECK(distance_at(field, {0, 0, 0}).value() == Approx(max_distance_m));
  for (int round = 0; round < 6; ++round) {
    std::set<std::tuple<int, int, int>> changed;
    const auto change = [&](const Voxel& v) { changed.emplace(v[0] >> 3, v[1] >> 3, v[2] >> 3); };
    if (round >= 3)  // removes half of the obstacles
      for (auto it = world.inside.begin(); it != world.inside.end();) {
        const bool stays = random() % 2 == 0;
        if (!stays) change(*it);
        it = stays ? std::next(it) : world.inside.erase(it);
      }
    for (int k = 0; k < 4; ++k) {
      const int x = any(random), y = any(random), z = any(random);
      for (int dx = 0; dx < 3; ++dx)
        for (int dy = 0; dy < 2; ++dy) {
          const Voxel v = {std::min(x + dx, world.side() - 1), std::min(y + dy, world.side() - 1),
                           z};
          world.inside.insert(v);
          change(v);
        }
      const int ux = any(random), uy = any(random), uz = any(random);
      world.unobserved.insert({ux, uy, uz});
      change({ux, uy, uz});
    }
    SpaceChanges changes;
    for (const auto& [x, y, z] : changed) changes.push_back(world.block({x, y, z}));
    field.set(changes);
    CHECK(check_all(world, field) > 10000);
  }
}

TEST_CASE("A slice has the distances to a wall") {
  World world(3);  // wall at x >= 12, with its surface at x = 11.5 voxels
  for (int x = 12; x < world.side(); ++x)
    for (int y = 0; y < world.side(); ++y)
      for (int z = 0; z < world.side(); ++z) world.inside.insert({x, y, z});
  DistanceField field(1.0, kVoxel_m);
  field.set(world.all());
  const auto slice = field.slice(1.04);
  CHECK(slice.size() == 24U * 24U);
  for (const auto& point : slice) {
    REQUIRE(point.point.z() == Approx(1.0));
    REQUIRE(point.distance_m == Approx(std::clamp(1.15 - point.point.x(), -1.0, 1.0)).margin(1e-6));
  }
}

// A camera in the origin of the odometry frame, whose z axis is that of the camera.
DepthImage wall_at(std::uint16_t millimetres) {
  return {160, 120, std::vector<std::uint16_t>(160 * 120, millimetres)};
}

TEST_CASE("The mapper reports space from which distances to a wall follow") {
  const Camera camera{.width = 160, .height = 120, .fx = 80, .fy = 80, .cx = 79.5, .cy = 59.5};
  SemanticMappingConfig config{.voxel_size_m = kVoxel_m, .min_views = 1, .window_m = 3.0};
  SemanticMapper mapper(config, camera);
  mapper.track_space(true);
  DistanceField field(1.0, kVoxel_m);
  const auto look = [&](const SE3& T_odom_cam, std::uint16_t millimetres, KeyframeIndex keyframe) {
    (void)mapper.integrate(wall_at(millimetres), nullptr, T_odom_cam, keyframe);
    field.set(mapper.take_space_changes());
  };
  const auto is_near = [&](const Voxel& voxel, double expected_m) {
    const auto found = distance_at(field, voxel);
    return found && std::abs(*found - expected_m) <= 0.5 * kVoxel_m;
  };
  look(SE3::Identity(), 2050, 0);
  for (const int z : {9, 13, 15, 19}) {
    CAPTURE(z);
    CHECK(is_near({0, 0, z}, std::min(1.0, 2.05 - kVoxel_m * z)));
  }
  CHECK(distance_at(field, {0, 0, 21}).value() < 0.0);
  CHECK_FALSE(distance_at(field, {0, 0, 30}));  // behind the wall
  CHECK_FALSE(distance_at(field, {30, 0, 5}));  // beside the image
  CHECK_FALSE(distance_at(field, {0, 0, -5}));  // behind the camera

  // The wall has moved away: the mapper removes the old one, and the space becomes free.
  for (KeyframeIndex k = 1; k < 200; ++k) look(SE3::Identity(), 3050, k);
  CHECK(distance_at(field, {0, 0, 19}).value() == Approx(1.0));
  CHECK(is_near({0, 0, 25}, 0.55));

  // The camera travels farther than the window, and looks elsewhere.
  SE3 away = SE3::Identity();
  away.translation() = Eigen::Vector3d(0, 0, -20);
  look(away, 2050, 200);
  CHECK_FALSE(distance_at(field, {0, 0, 19}));
  CHECK(is_near({0, 0, -185}, 0.55));
}

}  // namespace
}  // namespace km
