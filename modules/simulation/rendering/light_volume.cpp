#include "modules/simulation/rendering/light_volume.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

#include "modules/simulation/rendering/light_bake.hpp"

namespace km {
namespace {

// The finest lattice that keeps the number of samples near this.
constexpr float kSampleBudget = 700'000.0F;
constexpr float kFinestIndoors_m = 0.06F;
constexpr float kFinestOutdoors_m = 0.3F;
constexpr float kLargestAmbient = 2.0F;  // irradiance that 8 bits can hold

Eigen::Vector3f corner(const SurfaceMesh& mesh, std::size_t triangle, std::size_t i) {
  return mesh.vertices[mesh.triangles[triangle][i]];
}

float surface_area(const SurfaceMesh& mesh) {
  double twice = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3f p = corner(mesh, i, 0);
    twice += static_cast<double>((corner(mesh, i, 1) - p).cross(corner(mesh, i, 2) - p).norm());
  }
  return static_cast<float>(0.5 * twice);
}

float choose_cell(const World& world) {
  const float finest = world.lighting.sun > 0.0F ? kFinestOutdoors_m : kFinestIndoors_m;
  constexpr float kSamplesPerCellArea = 2.5F;  // a surface lies between two layers
  return std::max(finest,
                  std::sqrt(kSamplesPerCellArea * surface_area(world.mesh) / kSampleBudget));
}

// Calls visit(point) at points of the triangle at most `step_m` apart, at least once.
template <typename Visit>
void for_points_on(const SurfaceMesh& mesh, std::size_t triangle, float step_m,
                   const Visit& visit) {
  const Eigen::Vector3f p = corner(mesh, triangle, 0);
  const Eigen::Vector3f edge1 = corner(mesh, triangle, 1) - p;
  const Eigen::Vector3f edge2 = corner(mesh, triangle, 2) - p;
  const float longest = std::max({edge1.norm(), edge2.norm(), (edge2 - edge1).norm()});
  const int n = std::max(1, static_cast<int>(std::ceil(longest / step_m)));
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j)
      visit(Eigen::Vector3f(p + (static_cast<float>(i) * edge1 + static_cast<float>(j) * edge2) /
                                    static_cast<float>(n)));
}

}  // namespace

LightVolume::LightVolume(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
                         const Sky& sky)
    : lamps_(static_cast<int>(world.lighting.lamps.size())),
      ambient_scale_(kLargestAmbient / 255.0F),
      open_ambient_(world.lighting.ambient) {
  if (lamps_ > kMaxLamps)
    throw std::invalid_argument("world " + world.name + ": " + std::to_string(lamps_) +
                                " lamps, at most " + std::to_string(kMaxLamps) + " are supported");
  constexpr int kFewLamps = static_cast<int>(kFewLampsBytes) - kAxisDirections;
  sample_bytes_ = lamps_ <= kFewLamps ? kFewLampsBytes : kManyLampsBytes;
  if (world.mesh.triangles.empty()) return;
  lay_out(world);
  const std::vector<std::uint8_t> wanted = mark(world.mesh, surfaces);
  bake(LightBake(world, tracer, surfaces, sky), wanted);
}

void LightVolume::lay_out(const World& world) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& vertex : world.mesh.vertices) bounds.extend(vertex);
  cell_m_ = choose_cell(world);
  constexpr float kMostBricks = 4e6F;  // a few triangles far away must not cost gigabytes
  Eigen::Vector3f bricks;
  for (;; cell_m_ *= 1.25F) {
    const Eigen::Vector3f margin = Eigen::Vector3f::Constant(2.0F * cell_m_);
    origin_ = bounds.min() - margin;
    bricks = ((bounds.sizes() + 2.0F * margin) / (cell_m_ * kBrick)).array().ceil();
    if (bricks.prod() <= kMostBricks) break;
  }
  per_cell_ = 1.0F / cell_m_;
  bricks_ = bricks.cast<int>();
  brick_index_.assign(static_cast<std::size_t>(bricks_.prod()), -1);
}

// Which samples lookups on the surfaces will need: all corners of the cells they fall into.
std::vector<std::uint8_t> LightVolume::mark(const SurfaceMesh& mesh, const SurfaceTable& surfaces) {
  std::vector<std::uint8_t> wanted;
  const auto mark_cell = [&](const Eigen::Vector3f& point) {
    const Eigen::Vector3i cell = ((point - origin_) * per_cell_).cast<int>();
    const Eigen::Vector3i brick = cell / kBrick;
    const Eigen::Vector3i local = cell - kBrick * brick;
    std::int32_t& index = brick_index_[static_cast<std::size_t>(
        (brick.z() * bricks_.y() + brick.y()) * bricks_.x() + brick.x())];
    if (index < 0) {
      index = static_cast<std::int32_t>(wanted.size() / kBrickSamples);
      wanted.resize(wanted.size() + kBrickSamples, 0);
    }
    const std::size_t first =
        static_cast<std::size_t>(index) * kBrickSamples +
        static_cast<std::size_t>((local.z() * kSide + local.y()) * kSide + local.x());
    for (const std::size_t z : {0, kSide * kSide})
      for (const std::size_t y : {0, kSide})
        for (const std::size_t x : {0, 1}) wanted[first + z + y + x] = 1;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const SurfaceRecord& surface = surfaces.record(static_cast<std::uint32_t>(i));
    const Eigen::Vector3f lift = kLift * cell_m_ * surface.normal;
    const bool two_sided = surfaces.material(surface).transmission > 0.0F;
    for_points_on(mesh, i, 0.6F * cell_m_, [&](const Eigen::Vector3f& point) {
      mark_cell(point + lift);
      if (two_sided) mark_cell(point - lift);
    });
  }
  return wanted;
}

// Bakes the wanted samples in groups of neighbours; each group writes its own samples only, so the
// result does not depend on the number of threads.
void LightVolume::bake(const LightBake& light, const std::vector<std::uint8_t>& wanted) {
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i] != 0) list.push_back(i);
  samples_.assign(wanted.size() * sample_bytes_, 0);
  std::vector<std::uint8_t> known(wanted.size(), 0);
  const std::vector<Eigen::Vector3f> corners = brick_corners();
  const int groups = static_cast<int>((list.size() + kLanes - 1) / kLanes);
  cv::parallel_for_(cv::Range(0, groups), [&](const cv::Range& range) {
    std::vector<Eigen::Vector3f> points;
    for (int group = range.start; group < range.end; ++group) {
      const std::size_t begin = static_cast<std::size_t>(group) * kLanes;
      const std::size_t end = std::min(begin + kLanes, list.size());
      points.clear();
      for (std::size_t i = begin; i < end; ++i) points.push_back(position(corners, list[i]));
      const std::vector<LightBake::Sample> baked = light.at(points);
      for (std::size_t i = begin; i < end; ++i) {
        store(baked[i - begin], list[i]);
        known[list[i]] = baked[i - begin].inside ? 0 : 1;
      }
    }
  });
  // Samples inside of solids and behind surfaces take the light of their neighbours.
  constexpr int kFillSteps = 3;
  for (int step = 0; step < kFillSteps; ++step) fill_from_neighbours(known);
}

// First sample of each brick, by brick index.
std::vector<Eigen::Vector3f> LightVolume::brick_corners() const {
  std::vector<Eigen::Vector3f> corners(brick_index_.size());
  std::size_t cell = 0;
  for (int z = 0; z < bricks_.z(); ++z)
    for (int y = 0; y < bricks_.y(); ++y)
      for (int x = 0; x < bricks_.x(); ++x, ++cell)
        if (const std::int32_t index = brick_index_[cell]; index >= 0)
          corners[static_cast<std::size_t>(index)] =
              origin_ + cell_m_ * kBrick * Eigen::Vector3i(x, y, z).cast<float>();
  return corners;
}

Eigen::Vector3f LightVolume::position(const std::vector<Eigen::Vector3f>& corners,
                                      std::size_t sample) const {
  const std::size_t local = sample % kBrickSamples;
  const Eigen::Vector3f offset(static_cast<float>(local % kSide),
                               static_cast<float>(local / kSide % kSide),
                               static_cast<float>(local / (kSide * kSide)));
  return corners[sample / kBrickSamples] + cell_m_ * offset;
}

void LightVolume::store(const LightBake::Sample& baked, std::size_t sample) {
  std::uint8_t* bytes = samples_.data() + sample * sample_bytes_;
  const auto quantized = [](float value) {
    return static_cast<std::uint8_t>(std::min(255.0F, 255.0F * value + 0.5F));
  };
  for (std::size_t i = 0; i < kAxisDirections; ++i)
    bytes[i] = quantized(baked.ambient[i] / kLargestAmbient);
  for (std::size_t i = 0; i < baked.lamps.size(); ++i)
    bytes[kAxisDirections + i] = quantized(baked.lamps[i]);
}

void LightVolume::fill_from_neighbours(std::vector<std::uint8_t>& known) {
  std::vector<std::uint8_t> filled = known;
  std::vector<int> sum(sample_bytes_);
  for (std::size_t sample = 0; sample < known.size(); ++sample) {
    if (known[sample] != 0) continue;
    const std::size_t first = sample / kBrickSamples * kBrickSamples;
    const int local = static_cast<int>(sample - first);
    const Eigen::Vector3i at(local % kSide, local / kSide % kSide, local / (kSide * kSide));
    const Eigen::Vector3i low = (at.array() - 1).max(0);
    const Eigen::Vector3i high = (at.array() + 1).min(kSide - 1);
    std::fill(sum.begin(), sum.end(), 0);
    int count = 0;
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const std::size_t other = first + static_cast<std::size_t>((z * kSide + y) * kSide + x);
          if (known[other] == 0) continue;
          ++count;
          for (std::size_t i = 0; i < sample_bytes_; ++i)
            sum[i] += samples_[other * sample_bytes_ + i];
        }
    if (count == 0) continue;
    for (std::size_t i = 0; i < sample_bytes_; ++i)
      samples_[sample * sample_bytes_ + i] = static_cast<std::uint8_t>(sum[i] / count);
    filled[sample] = 1;
  }
  known = std::move(filled);
}

}  // namespace km
