#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "modules/simulation/rendering/light_bake.hpp"
#include "modules/simulation/rendering/ray_tracer.hpp"
#include "modules/simulation/rendering/sky.hpp"
#include "modules/simulation/rendering/surface_table.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// Light that comes from all around, baked once: on a lattice near the surfaces, for each of the
/// six axis directions, what the sky and the lit surroundings give a surface that faces there, and
/// how much of each lamp is seen. In between it is interpolated. Corners and contacts are dark
/// because little of the surroundings is bright there. Immutable.
class LightVolume {
 public:
  static constexpr int kMaxLamps = 10;

  struct Light {
    float ambient = 0.0F;                          ///< Irradiance.
    std::array<float, kMaxLamps> lamp_visibility;  ///< 0 to 1; only those of the world are set.
  };

  /// Throws std::invalid_argument for more than kMaxLamps lamps.
  LightVolume(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
              const Sky& sky);

  /// Light at a point of a surface, `normal` towards the side that is lit; unit length.
  [[nodiscard]] Light at(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const;

  [[nodiscard]] float cell_m() const { return cell_m_; }

 private:
  // A brick holds kBrick^3 cells, so (kBrick + 1)^3 samples: the last ones are those of the next
  // brick again, and a lookup stays within one brick.
  static constexpr int kBrick = 8;
  static constexpr int kSide = kBrick + 1;
  static constexpr std::size_t kBrickSamples = std::size_t{kSide} * kSide * kSide;

  void lay_out(const World& world);
  [[nodiscard]] std::vector<std::uint8_t> mark(const SurfaceMesh& mesh,
                                               const SurfaceTable& surfaces);
  void bake(const LightBake& light, const std::vector<std::uint8_t>& wanted);
  [[nodiscard]] std::vector<Eigen::Vector3f> brick_corners() const;
  [[nodiscard]] Eigen::Vector3f position(const std::vector<Eigen::Vector3f>& corners,
                                         std::size_t sample) const;
  void store(const LightBake::Sample& baked, std::size_t sample);
  void fill_from_neighbours(std::vector<std::uint8_t>& known);
  void interpolate(const std::uint8_t* low, const Eigen::Vector3f& share,
                   const Eigen::Vector3f& normal, Light& light) const;

  float cell_m_ = 0.5F;
  float per_cell_ = 2.0F;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i bricks_ = Eigen::Vector3i::Zero();  ///< Along each axis.
  std::vector<std::int32_t> brick_index_;             ///< -1: no surface near.
  std::size_t sample_bytes_ = 8;  ///< Six directions, then the lamps, padded to eight.
  std::vector<std::uint8_t> samples_;
  int lamps_ = 0;
  float ambient_scale_ = 1.0F;  ///< Irradiance of one step of 8 bit.
  float open_ambient_ = 0.0F;   ///< Where nothing was baked.
};

}  // namespace km
