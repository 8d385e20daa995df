#include "apps/lab/simulation/rendering/light_volume.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <span>

namespace km {
namespace {

constexpr int kDirections = 48;
constexpr int kLampPoints = 12;
constexpr float kLampRadius_m = 0.25F;  // ceiling lights with a frosted cover
constexpr float kFar = std::numeric_limits<float>::infinity();

// Points spread evenly over the sphere (Fibonacci lattice), and their cosines to the axes as
// weights that sum up to one.
struct DirectionSet {
  std::array<Eigen::Vector3f, kDirections> directions;
  std::array<std::array<float, kAxisDirections>, kDirections> weights;
};

float cosine_to_axis(const Eigen::Vector3f& d, int axis) {
  return std::max(0.0F, axis % 2 == 0 ? d[axis / 2] : -d[axis / 2]);
}

DirectionSet make_directions() {
  DirectionSet set;
  std::array<float, kAxisDirections> sums{};
  for (int i = 0; i < kDirections; ++i) {
    const float z = 1.0F - (2.0F * static_cast<float>(i) + 1.0F) / kDirections;
    const float azimuth = static_cast<float>(i) * 2.0F * std::numbers::pi_v<float> *
                          (1.0F - 1.0F / std::numbers::phi_v<float>);
    const float radius = std::sqrt(1.0F - z * z);
    const Eigen::Vector3f d(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
    const auto index = static_cast<std::size_t>(i);
    set.directions[index] = d;
    for (int axis = 0; axis < kAxisDirections; ++axis) {
      set.weights[index][static_cast<std::size_t>(axis)] = cosine_to_axis(d, axis);
      sums[static_cast<std::size_t>(axis)] += cosine_to_axis(d, axis);
    }
  }
  for (auto& weights : set.weights)
    for (std::size_t axis = 0; axis < kAxisDirections; ++axis) weights[axis] /= sums[axis];
  return set;
}

const DirectionSet& direction_set() {
  static const DirectionSet set = make_directions();
  return set;
}

LaneMask mask_of(std::size_t count) {
  return (1U << count) - 1U;
}

/// Casts the rays behind LightVolume. Immutable, safe to use from several threads.
class LightBake {
 public:
  LightBake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
            const Sky& sky)
      : lighting_(world.lighting),
        tracer_(tracer),
        surfaces_(surfaces),
        sky_(sky),
        indoors_(!(world.lighting.sun > 0.0F)) {}

  struct Sample {
    std::array<float, kAxisDirections> ambient{};  ///< Irradiance of a surface facing there.
    std::vector<float> lamps;                      ///< Visible share of each.
    bool inside = false;  ///< true inside a solid: the sample must not light its neighbours
  };

  /// At most kLanes points near each other, because rays of the same direction are traced together.
  [[nodiscard]] std::vector<Sample> at(std::span<const Eigen::Vector3f> points) const {
    std::vector<Sample> samples(points.size());
    add_surroundings(points, samples);
    if (!lighting_.lamps.empty()) add_lamps(points, samples);
    return samples;
  }

 private:
  void add_surroundings(std::span<const Eigen::Vector3f> points,
                        std::vector<Sample>& samples) const {
    const DirectionSet& set = direction_set();
    RayPacket rays;
    std::array<int, kLanes> backs{};
    for (std::size_t i = 0; i < kDirections; ++i) {
      const Eigen::Vector3f& d = set.directions[i];
      for (std::size_t lane = 0; lane < points.size(); ++lane)
        set_ray(rays, static_cast<int>(lane), points[lane], d, 0.0F, kFar);
      tracer_.intersect(mask_of(points.size()), rays);
      LaneMask hits = 0;
      for (std::size_t lane = 0; lane < points.size(); ++lane)
        if (rays.hit.primID[lane] != kNoTriangle) hits |= 1U << lane;
      const LaneMask lit = indoors_ ? 0U : sunlit(hits, rays);
      for (std::size_t lane = 0; lane < points.size(); ++lane) {
        float radiance = 0.0F;
        if (has_lane(hits, lane)) {
          const SurfaceRecord& surface = surfaces_.record(rays.hit.primID[lane]);
          const bool back = surface.normal.dot(d) > 0.0F;
          backs[lane] +=
              static_cast<int>(back && !(surfaces_.material(surface).transmission > 0.0F));
          radiance = reflected(surface, rays.ray.tfar[lane], has_lane(lit, lane));
        } else if (indoors_) {
          radiance = lighting_.ambient;
        } else {
          radiance = d.z() > 0.0F ? sky_.luminance(d) : 0.3F * sky_.haze_luminance();
        }
        for (std::size_t axis = 0; axis < kAxisDirections; ++axis)
          samples[lane].ambient[axis] += set.weights[i][axis] * radiance;
      }
    }
    for (std::size_t lane = 0; lane < points.size(); ++lane)
      samples[lane].inside = 3 * backs[lane] > kDirections;
  }

  // Lanes among `hits` that the sun lights, on the side from which they are seen.
  [[nodiscard]] LaneMask sunlit(LaneMask hits, const RayPacket& rays) const {
    RayPacket shadow;
    LaneMask facing = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!has_lane(hits, static_cast<std::size_t>(lane))) continue;
      const SurfaceRecord& surface = surfaces_.record(rays.hit.primID[lane]);
      const Eigen::Vector3f d(rays.ray.dir_x[lane], rays.ray.dir_y[lane], rays.ray.dir_z[lane]);
      const Eigen::Vector3f o(rays.ray.org_x[lane], rays.ray.org_y[lane], rays.ray.org_z[lane]);
      const float side = surface.normal.dot(d) > 0.0F ? -1.0F : 1.0F;
      if (side * surface.normal.dot(lighting_.to_sun) <= 0.0F) continue;
      facing |= 1U << lane;
      constexpr float kLift_m = 0.003F;
      const Eigen::Vector3f start = o + rays.ray.tfar[lane] * d + (side * kLift_m) * surface.normal;
      set_ray(shadow, lane, start, lighting_.to_sun, 0.0F, kFar);
    }
    return facing & ~tracer_.occluded(facing, shadow);
  }

  // Light that a surface reflects: its mean albedo under the sun, if that shines there, and under a
  // part of the sky. Indoors the surroundings count as lit like the room, except that near ones are
  // dark, because they receive little light themselves.
  [[nodiscard]] float reflected(const SurfaceRecord& surface, float distance_m, bool sunlit) const {
    if (indoors_) {
      constexpr float kReach_m = 0.8F;
      return lighting_.ambient * (1.0F - std::exp(-distance_m / kReach_m));
    }
    constexpr float kSkySeen = 0.5F;
    const float direct =
        sunlit ? lighting_.sun * std::abs(surface.normal.dot(lighting_.to_sun)) : 0.0F;
    return surfaces_.material(surface).mean_luminance * (direct + kSkySeen * lighting_.ambient);
  }

  void add_lamps(std::span<const Eigen::Vector3f> points, std::vector<Sample>& samples) const {
    RayPacket rays;
    for (const Lighting::Lamp& lamp : lighting_.lamps) {
      for (Sample& sample : samples) sample.lamps.push_back(0.0F);
      for (int i = 0; i < kLampPoints; ++i) {
        // A disc that faces down, its points on a spiral of equal areas.
        const float radius =
            kLampRadius_m * std::sqrt((static_cast<float>(i) + 0.5F) / kLampPoints);
        const float azimuth = static_cast<float>(i) * 2.399963F;  // the golden angle
        const Eigen::Vector3f light =
            lamp.position +
            Eigen::Vector3f(radius * std::cos(azimuth), radius * std::sin(azimuth), 0.0F);
        // Rays go from the lamp to the points, because rays with a common origin are faster. They
        // begin outside the lamp's own body.
        constexpr float kFirst = 0.05F;
        for (std::size_t lane = 0; lane < points.size(); ++lane)
          set_ray(rays, static_cast<int>(lane), light, points[lane] - light, kFirst, 0.999F);
        const LaneMask hidden = tracer_.occluded(mask_of(points.size()), rays);
        for (std::size_t lane = 0; lane < points.size(); ++lane)
          if (!has_lane(hidden, lane)) samples[lane].lamps.back() += 1.0F / kLampPoints;
      }
    }
  }

  const Lighting& lighting_;
  const RayTracer& tracer_;
  const SurfaceTable& surfaces_;
  const Sky& sky_;
  bool indoors_;
};

// The spacing of the lattice is the finest that keeps the number of samples near this.
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

std::uint8_t quantized(float share) {
  return static_cast<std::uint8_t>(std::min(255.0F, 255.0F * share + 0.5F));
}

// Value of byte `shift` / 8 of a word.
float byte_of(std::uint32_t word, std::uint32_t shift) {
  return static_cast<float>(static_cast<std::int32_t>(word >> shift & 0xFFU));
}

// Squares of the normals' components, and for each axis the direction that the normal is nearer to,
// as the shift of its byte.
struct Leaning {
  Lanes3 weight;
  BitLanes x, y, z;
};

void lean(const Lanes3& normals, Leaning& leaning) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    leaning.weight.x[i] = normals.x[i] * normals.x[i];
    leaning.weight.y[i] = normals.y[i] * normals.y[i];
    leaning.weight.z[i] = normals.z[i] * normals.z[i];
    leaning.x[i] = normals.x[i] < 0.0F ? 8 : 0;
    leaning.y[i] = normals.y[i] < 0.0F ? 24 : 16;
    leaning.z[i] = normals.z[i] < 0.0F ? 8 : 0;
  }
}

// A sample's bytes of every lane, four to a word.
using SampleWords = std::array<BitLanes, 4>;

void fetch(const std::array<const std::uint8_t*, kLanes>& low, std::size_t offset,
           SampleWords& words) {
  for (std::size_t i = 0; i < kLanes; ++i)
    for (std::size_t k = 0; k < words.size(); ++k)
      std::memcpy(&words[k][i], low[i] + offset + 4 * k, sizeof(std::uint32_t));
}

void add_ambient(const BitLanes& word0, const BitLanes& word1, const Lanes& weight,
                 const Leaning& leaning, Lanes& sum) {
  for (std::size_t i = 0; i < kLanes; ++i)
    sum[i] += weight[i] * (leaning.weight.x[i] * byte_of(word0[i], leaning.x[i]) +
                           leaning.weight.y[i] * byte_of(word0[i], leaning.y[i]) +
                           leaning.weight.z[i] * byte_of(word1[i], leaning.z[i]));
}

void add_lamp(const BitLanes& word, std::uint32_t shift, const Lanes& weight, Lanes& sum) {
  for (std::size_t i = 0; i < kLanes; ++i) sum[i] += weight[i] * byte_of(word[i], shift);
}

// Weights of corner `index` of a cell: bit 0 is x, bit 1 y, bit 2 z.
void corner_weights(std::size_t index, const Lanes3& share, Lanes& weights) {
  const bool x = (index & 1U) != 0U;
  const bool y = (index & 2U) != 0U;
  const bool z = (index & 4U) != 0U;
  for (std::size_t i = 0; i < kLanes; ++i)
    weights[i] = (x ? share.x[i] : 1.0F - share.x[i]) * (y ? share.y[i] : 1.0F - share.y[i]) *
                 (z ? share.z[i] : 1.0F - share.z[i]);
}

}  // namespace

LightVolume::LightVolume(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
                         const Sky& sky)
    : lamps_(static_cast<int>(world.lighting.lamps.size())),
      ambient_scale_(kLargestAmbient / 255.0F),
      open_ambient_(world.lighting.ambient) {
  if (world.mesh.triangles.empty()) return;
  lay_out(world);
  const std::vector<std::uint8_t> wanted = mark(world.mesh, surfaces);
  bake(world, tracer, surfaces, sky, wanted);
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

// Marks the samples that lookups on the surfaces need: all corners of the cells that contain a
// point.
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
    constexpr std::size_t kRow = kSide;
    for (const std::size_t z : {std::size_t{0}, kRow * kRow})
      for (const std::size_t y : {std::size_t{0}, kRow})
        for (const std::size_t x : {0U, 1U}) wanted[first + z + y + x] = 1;
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
void LightVolume::bake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
                       const Sky& sky, const std::vector<std::uint8_t>& wanted) {
  const LightBake light(world, tracer, surfaces, sky);
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i] != 0) list.push_back(i);
  samples_.assign(wanted.size() * kSampleBytes, 0);
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
        std::uint8_t* const bytes = samples_.data() + list[i] * kSampleBytes;
        for (std::size_t k = 0; k < kAxisDirections; ++k)
          bytes[k] = quantized(baked[i - begin].ambient[k] / kLargestAmbient);
        for (std::size_t k = 0; k < baked[i - begin].lamps.size(); ++k)
          bytes[kAxisDirections + k] = quantized(baked[i - begin].lamps[k]);
        known[list[i]] = baked[i - begin].inside ? 0 : 1;
      }
    }
  });
  // Samples inside solids and behind surfaces take the light of their neighbours.
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
  const std::size_t row = local / kSide, layer = row / kSide;
  const Eigen::Vector3f offset(static_cast<float>(local % kSide), static_cast<float>(row % kSide),
                               static_cast<float>(layer));
  return corners[sample / kBrickSamples] + cell_m_ * offset;
}

void LightVolume::fill_from_neighbours(std::vector<std::uint8_t>& known) {
  std::vector<std::uint8_t> filled = known;
  std::vector<int> sum(kSampleBytes);
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
          for (std::size_t i = 0; i < kSampleBytes; ++i)
            sum[i] += samples_[other * kSampleBytes + i];
        }
    if (count == 0) continue;
    for (std::size_t i = 0; i < kSampleBytes; ++i)
      samples_[sample * kSampleBytes + i] = static_cast<std::uint8_t>(sum[i] / count);
    filled[sample] = 1;
  }
  known = std::move(filled);
}

void LightVolume::find_cells(const Lanes3& points, const Lanes3& normals, Cells& cells) const {
  const float lift_m = kLift * cell_m_;
  const float per_cell = per_cell_;
  const Eigen::Vector3f origin = origin_;
  const Eigen::Vector3i bricks = bricks_;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float x = (points.x[i] + lift_m * normals.x[i] - origin.x()) * per_cell;
    const float y = (points.y[i] + lift_m * normals.y[i] - origin.y()) * per_cell;
    const float z = (points.z[i] + lift_m * normals.z[i] - origin.z()) * per_cell;
    const auto ix = static_cast<std::int32_t>(x);
    const auto iy = static_cast<std::int32_t>(y);
    const auto iz = static_cast<std::int32_t>(z);
    const std::int32_t bx = ix / kBrick;
    const std::int32_t by = iy / kBrick;
    const std::int32_t bz = iz / kBrick;
    // Without branches, so that the compiler vectorises the loop over lanes.
    const float least = std::min(x, std::min(y, z));
    const std::int32_t spare =
        std::min(bricks.x() - bx, std::min(bricks.y() - by, bricks.z() - bz));
    const std::int32_t place = (bz * bricks.y() + by) * bricks.x() + bx;
    cells.brick[i] = ((least >= 0.0F) & (spare > 0)) ? place : -1;
    cells.corner[i] =
        ((iz - bz * kBrick) * kSide + (iy - by * kBrick)) * kSide + (ix - bx * kBrick);
    cells.share.x[i] = x - static_cast<float>(ix);
    cells.share.y[i] = y - static_cast<float>(iy);
    cells.share.z[i] = z - static_cast<float>(iz);
  }
}

// Trilinear in the lattice. In direction, the squares of the normal's components weight the three
// axis directions that are nearest to it (the ambient cube).
void LightVolume::interpolate(const Cells& cells, const Lanes3& normals, Light& light) const {
  const auto lamps = static_cast<std::size_t>(lamps_);
  std::array<const std::uint8_t*, kLanes> low;
  IntLanes baked;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::int32_t place = cells.brick[i];
    const std::int32_t brick = place < 0 ? -1 : brick_index_[static_cast<std::size_t>(place)];
    baked[i] = brick < 0 ? 0 : 1;
    const std::size_t sample = static_cast<std::size_t>(std::max(brick, 0)) * kBrickSamples +
                               static_cast<std::size_t>(brick < 0 ? 0 : cells.corner[i]);
    low[i] = samples_.data() + sample * kSampleBytes;
  }
  Leaning leaning;
  lean(normals, leaning);
  light.ambient.fill(0.0F);
  for (std::size_t lamp = 0; lamp < lamps; ++lamp) light.lamp_visibility[lamp].fill(0.0F);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t sample =
        (corner & 1U) + (corner >> 1U & 1U) * kSide + (corner >> 2U) * kSide * kSide;
    SampleWords words;
    fetch(low, sample * kSampleBytes, words);
    Lanes weights;
    corner_weights(corner, cells.share, weights);
    add_ambient(words[0], words[1], weights, leaning, light.ambient);
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
      const std::size_t byte = kAxisDirections + lamp;
      add_lamp(words[byte / 4], static_cast<std::uint32_t>(8 * (byte % 4)), weights,
               light.lamp_visibility[lamp]);
    }
  }
  for (std::size_t i = 0; i < kLanes; ++i)
    light.ambient[i] = baked[i] != 0 ? ambient_scale_ * light.ambient[i] : open_ambient_;
  for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
    Lanes& visibility = light.lamp_visibility[lamp];
    for (std::size_t i = 0; i < kLanes; ++i)
      visibility[i] = baked[i] != 0 ? visibility[i] / 255.0F : 1.0F;
  }
}

void LightVolume::look_up(const Lanes3& points, const Lanes3& normals, Light& light) const {
  run_wide([&] {
    Cells cells;
    find_cells(points, normals, cells);
    interpolate(cells, normals, light);
  });
}

}  // namespace km
