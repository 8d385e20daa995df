#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "modules/simulation/rendering/lanes.hpp"
#include "modules/simulation/rendering/ray_tracer.hpp"
#include "modules/simulation/rendering/sky.hpp"
#include "modules/simulation/rendering/surfaces.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// The six axis directions: +x, -x, +y, -y, +z, -z.
inline constexpr int kAxisDirections = 6;

/// Light that comes from all around, baked once: on a lattice near the surfaces, for each of the
/// six axis directions, what the sky and the lit surroundings give a surface that faces there, and
/// how much of each lamp is seen. In between it is interpolated. Corners and contacts are dark
/// because little of the surroundings is bright there. Immutable.
class LightVolume {
 public:
  static constexpr int kMaxLamps = 10;

  struct Light {
    Lanes ambient;                                 ///< Irradiance.
    std::array<Lanes, kMaxLamps> lamp_visibility;  ///< 0 to 1; only those of the world are set.
  };

  /// Throws std::invalid_argument for more than kMaxLamps lamps.
  LightVolume(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
              const Sky& sky);

  /// Light at points of surfaces, `normals` towards the sides that are lit; unit length.
  void look_up(const Lanes3& points, const Lanes3& normals, Light& light) const;

 private:
  static constexpr float kLift = 0.5F;  // light is looked up this far before the surface [cells]
  // A brick holds kBrick^3 cells, so (kBrick + 1)^3 samples: the last ones are those of the next
  // brick again, and a lookup stays within one brick.
  static constexpr int kBrick = 8;
  static constexpr int kSide = kBrick + 1;
  static constexpr std::size_t kBrickSamples = std::size_t{kSide} * kSide * kSide;

  void lay_out(const World& world);
  [[nodiscard]] std::vector<std::uint8_t> mark(const SurfaceMesh& mesh,
                                               const SurfaceTable& surfaces);
  void bake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
            const Sky& sky, const std::vector<std::uint8_t>& wanted);
  [[nodiscard]] std::vector<Eigen::Vector3f> brick_corners() const;
  [[nodiscard]] Eigen::Vector3f position(const std::vector<Eigen::Vector3f>& corners,
                                         std::size_t sample) const;
  void fill_from_neighbours(std::vector<std::uint8_t>& known);
  /// Where lookups fall: the lowest corner of a cell, and how far they are beyond it.
  struct Cells {
    IntLanes brick;   ///< Place in brick_index_; -1: outside of it.
    IntLanes corner;  ///< Sample within the brick.
    Lanes3 share;
  };
  void find_cells(const Lanes3& points, const Lanes3& normals, Cells& cells) const;
  template <std::size_t kWords>
  void interpolate(const Cells& cells, const Lanes3& normals, Light& light) const;

  float cell_m_ = 0.5F;
  float per_cell_ = 2.0F;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i bricks_ = Eigen::Vector3i::Zero();  ///< Along each axis.
  std::vector<std::int32_t> brick_index_;             ///< -1: no surface near.
  /// A sample is six directions, then the lamps.
  static constexpr std::size_t kFewLampsBytes = 8;
  static constexpr std::size_t kManyLampsBytes = 16;
  static_assert(kAxisDirections + kMaxLamps == kManyLampsBytes);
  std::size_t sample_bytes_ = kFewLampsBytes;
  std::vector<std::uint8_t> samples_;
  int lamps_ = 0;
  float ambient_scale_ = 1.0F;  ///< Irradiance of one step of 8 bit.
  float open_ambient_ = 0.0F;   ///< Where nothing was baked.
};

}  // namespace km
