#include "apps/lab/simulation/rendering/surfaces.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

namespace km {
namespace {

ShadingMaterial shading_material(const World& world, const Material& material) {
  ShadingMaterial result;
  const auto layer = [&world](std::uint16_t texture, float period_m) {
    return TextureLayer{world.textures[texture].gray_texels(), 1.0F / period_m};
  };
  result.base = layer(material.base, material.base_period_m);
  result.detail = layer(material.detail, material.detail_period_m);
  result.tint_luminance = luminance_of(material.tint);
  result.specular = material.specular;
  result.glow = material.glow;
  if (material.label == SurfaceClass::kVegetation) result.transmission = 0.5F;
  if (material.label == SurfaceClass::kTent) result.transmission = 0.15F;
  if (material.label == SurfaceClass::kCurtain) result.transmission = 0.3F;
  result.mean_luminance =
      luminance_of(material.tint.cwiseProduct(world.textures[material.base].mean_color()));
  result.label = static_cast<LabelId>(material.label);
  result.foliage = material.label == SurfaceClass::kVegetation;
  return result;
}

SurfaceRecord surface_record(const SurfaceMesh& mesh, std::size_t index) {
  const auto& triangle = mesh.triangles[index];
  const Eigen::Vector3f& p0 = mesh.vertices[triangle[0]];
  const Eigen::Vector3f edge1 = mesh.vertices[triangle[1]] - p0;
  const Eigen::Vector3f edge2 = mesh.vertices[triangle[2]] - p0;
  SurfaceRecord record;
  record.material = mesh.materials[index];
  record.normal = edge1.cross(edge2).normalized();
  for (const std::uint32_t vertex : triangle)
    record.smooth = record.smooth || mesh.normals[vertex].dot(record.normal) < 0.9999F;

  // The gradient within the plane: its products with the edges are the differences of uv.
  const Eigen::Vector2f uv0 = mesh.uv[triangle[0]];
  Eigen::Matrix3f frame;
  frame << edge1.transpose(), edge2.transpose(), record.normal.transpose();
  Eigen::Matrix<float, 3, 2> difference = Eigen::Matrix<float, 3, 2>::Zero();
  difference.row(0) = mesh.uv[triangle[1]] - uv0;
  difference.row(1) = mesh.uv[triangle[2]] - uv0;
  Eigen::Matrix<float, 3, 2> gradient = frame.inverse() * difference;
  if (!gradient.allFinite()) gradient.setZero();
  record.u_gradient = gradient.col(0);
  record.v_gradient = gradient.col(1);
  record.u_offset = uv0.x() - record.u_gradient.dot(p0);
  record.v_offset = uv0.y() - record.v_gradient.dot(p0);
  return record;
}

// Inputs of locate(), as lanes.
struct Gathered {
  Lanes3 origin, direction, right, down;
  Lanes t;
  Lanes3 plane_normal, normal;  // the latter not of unit length
  Lanes3 u_gradient, v_gradient;
  Lanes u_offset, v_offset;
};

Lanes lanes_of(const float* values) {
  Lanes lanes;
  std::copy_n(values, kLanes, lanes.begin());
  return lanes;
}

// Lanes without a surface copy the first lane that has one.
Gathered gather(const SurfaceView& surfaces, const SurfaceHits& hits, SurfacePoints& points) {
  const RTCRay16& ray = hits.rays.ray;
  const RTCHit16& hit = hits.rays.hit;
  Gathered g;
  g.origin = {lanes_of(ray.org_x), lanes_of(ray.org_y), lanes_of(ray.org_z)};
  g.direction = {lanes_of(ray.dir_x), lanes_of(ray.dir_y), lanes_of(ray.dir_z)};
  g.t = lanes_of(ray.tfar);
  g.right = hits.right;
  g.down = hits.down;
  const auto first = static_cast<std::size_t>(std::countr_zero(hits.surface));
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t from = has_lane(hits.surface, lane) ? lane : first;
    if (from != lane) {
      for (Lanes3* lanes : {&g.origin, &g.direction, &g.right, &g.down})
        lanes->set(lane, lanes->at(from));
      g.t[lane] = g.t[from];
    }
    const std::uint32_t triangle = hit.primID[from];
    const SurfaceRecord& surface = surfaces.record(triangle);
    points.material[lane] = &surfaces.material_of(triangle);
    g.plane_normal.set(lane, surface.normal);
    g.normal.set(lane, surface.smooth
                           ? surfaces.interpolated_normal(triangle, hit.u[from], hit.v[from])
                           : surface.normal);
    g.u_gradient.set(lane, surface.u_gradient);
    g.v_gradient.set(lane, surface.v_gradient);
    g.u_offset[lane] = surface.u_offset;
    g.v_offset[lane] = surface.v_offset;
  }
  return g;
}

void set_geometry(const Gathered& g, SurfacePoints& points) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float length = std::sqrt(dot(g.direction, g.direction, i));
    points.view.x[i] = g.direction.x[i] / length;
    points.view.y[i] = g.direction.y[i] / length;
    points.view.z[i] = g.direction.z[i] / length;
    points.distance_m[i] = length * g.t[i];
    points.position.x[i] = g.origin.x[i] + g.t[i] * g.direction.x[i];
    points.position.y[i] = g.origin.y[i] + g.t[i] * g.direction.y[i];
    points.position.z[i] = g.origin.z[i] + g.t[i] * g.direction.z[i];
    const float side = dot(g.plane_normal, g.direction, i) > 0.0F ? -1.0F : 1.0F;
    points.plane_normal.x[i] = side * g.plane_normal.x[i];
    points.plane_normal.y[i] = side * g.plane_normal.y[i];
    points.plane_normal.z[i] = side * g.plane_normal.z[i];
    const float norm2 = dot(g.normal, g.normal, i);
    const float scale = norm2 > 0.0F ? side / std::sqrt(norm2) : 0.0F;
    points.normal.x[i] = scale * g.normal.x[i];
    points.normal.y[i] = scale * g.normal.y[i];
    points.normal.z[i] = scale * g.normal.z[i];
    points.u[i] = dot(g.u_gradient, points.position, i) + g.u_offset[i];
    points.v[i] = dot(g.v_gradient, points.position, i) + g.v_offset[i];
  }
}

// The hit moves with the direction d as t * (dd - d * (n . dd) / (n . d)): the Jacobian J of the
// texture coordinates. The unit circle of the pixel becomes an ellipse there, whose semi-axes are
// the eigenvectors of J J^T.
void set_footprints(const Gathered& g, SurfacePoints& points) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float along = dot(g.plane_normal, g.direction, i);
    const float slope_right = dot(g.plane_normal, g.right, i) / along;
    const float slope_down = dot(g.plane_normal, g.down, i) / along;
    const float u_along = dot(g.u_gradient, g.direction, i);
    const float v_along = dot(g.v_gradient, g.direction, i);
    const float u_x = g.t[i] * (dot(g.u_gradient, g.right, i) - slope_right * u_along);
    const float u_y = g.t[i] * (dot(g.u_gradient, g.down, i) - slope_down * u_along);
    const float v_x = g.t[i] * (dot(g.v_gradient, g.right, i) - slope_right * v_along);
    const float v_y = g.t[i] * (dot(g.v_gradient, g.down, i) - slope_down * v_along);

    const float a = u_x * u_x + u_y * u_y;
    const float b = u_x * v_x + u_y * v_y;
    const float c = v_x * v_x + v_y * v_y;
    const float half = 0.5F * (a - c);
    const float largest = 0.5F * (a + c) + std::sqrt(half * half + b * b);
    // Two forms of the eigenvector; the longer one is the safe one.
    const float eu = half > 0.0F ? largest - c : b;
    const float ev = half > 0.0F ? b : largest - a;
    const float length = std::sqrt(eu * eu + ev * ev);
    constexpr float kMost_m = 1e4F;  // limit of the footprint at the horizon
    const float major_m = std::min(std::sqrt(largest), kMost_m);
    const float area = std::abs(u_x * v_y - u_y * v_x);
    points.major_m[i] = major_m;
    points.minor_m[i] = major_m > 0.0F ? std::min(area / major_m, major_m) : 0.0F;
    const float scale = length > 0.0F ? major_m / length : 0.0F;
    points.major_u[i] = scale * eu;
    points.major_v[i] = scale * ev;
  }
}

// Coordinates on a tile in units of 2^-30; higher bits wrap.
constexpr int kTileBits = 30;
constexpr std::uint32_t kPositionMask = (1U << kTileBits) - 1U;
constexpr int kWeightBits = 16;  // bits of the weight from a texel to the next

// One texture per lane.
struct TextureLanes {
  std::array<const std::uint32_t*, kLanes> quads;
  IntLanes log_size;
  Lanes scale;
  Lanes per_m;
};

struct LevelBlend {
  IntLanes fine, coarse;
  Lanes share;  // share of the coarser level
};

TextureLanes textures_of(const SurfacePoints& points, TextureLayer ShadingMaterial::*layer) {
  TextureLanes textures;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const TextureLayer& texture = points.material[i]->*layer;
    textures.quads[i] = texture.gray.quads;
    textures.log_size[i] = texture.gray.log_size;
    textures.scale[i] = texture.gray.scale;
    textures.per_m[i] = texture.per_m;
  }
  return textures;
}

// Between two levels the blend is linear in the footprint.
void blend_levels(const TextureLanes& textures, const Taps& taps, LevelBlend& blend) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto size = std::bit_cast<float>((127 + textures.log_size[i]) << 23);
    const float texels = taps.width_m[i] * textures.per_m[i] * size;
    const auto bits = std::bit_cast<std::int32_t>(texels);
    const std::int32_t exponent = (bits >> 23) - 127;  // floor(log2(texels))
    const auto mantissa = std::bit_cast<float>((bits & 0x007FFFFF) | 0x3F800000);  // 1 to 2
    const bool between = exponent >= 0 && exponent < textures.log_size[i];
    blend.fine[i] = std::clamp(exponent, 0, textures.log_size[i]);
    blend.coarse[i] = blend.fine[i] + (between ? 1 : 0);
    blend.share[i] = between ? mantissa - 1.0F : 0.0F;
  }
}

// Fraction of a tile, in units of 2^-30.
std::uint32_t tile_point(float tiles) {
  const float fraction = tiles - static_cast<float>(static_cast<std::int32_t>(tiles));
  return static_cast<std::uint32_t>(
      static_cast<std::int32_t>(fraction * static_cast<float>(1U << kTileBits)));
}

// Adds weight * the bilinear lookup in one level, in units of 2^-16 of the storage's step.
void add_level(const TextureLanes& textures, const IntLanes& level, const BitLanes& u,
               const BitLanes& v, const Lanes& weight, Lanes& sum) {
  BitLanes index;
  BitLanes quad;
  IntLanes x;
  IntLanes y;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto log_n = static_cast<std::uint32_t>(textures.log_size[i] - level[i]);
    const std::uint32_t half_texel = 1U << (kTileBits - 1) >> log_n;
    const std::uint32_t at_u = (u[i] - half_texel) & kPositionMask;
    const std::uint32_t at_v = (v[i] - half_texel) & kPositionMask;
    const std::uint32_t column = at_u >> (kTileBits - log_n);
    const std::uint32_t row = at_v >> (kTileBits - log_n);
    x[i] = static_cast<std::int32_t>((at_u << log_n & kPositionMask) >> (kTileBits - kWeightBits));
    y[i] = static_cast<std::int32_t>((at_v << log_n & kPositionMask) >> (kTileBits - kWeightBits));
    // The levels before this one: a sum of powers of four, (4^k - 1) / 3 each.
    constexpr std::uint32_t kThird = 0x55555555U;
    const std::uint32_t begin =
        (kThird >> (30 - 2 * textures.log_size[i])) - (kThird >> (30U - 2U * log_n));
    index[i] = begin + (row << log_n) + column;
  }
  for (std::size_t i = 0; i < kLanes; ++i) quad[i] = textures.quads[i][index[i]];
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto byte = [&](int k) { return static_cast<std::int32_t>(quad[i] >> (8 * k) & 0xFFU); };
    const std::int32_t low = (byte(0) << kWeightBits) + x[i] * (byte(1) - byte(0));
    const std::int32_t high = (byte(2) << kWeightBits) + x[i] * (byte(3) - byte(2));
    constexpr float kUnit = 1.0F / (1U << kWeightBits);
    sum[i] += weight[i] * (static_cast<float>(low) +
                           kUnit * static_cast<float>(y[i]) * static_cast<float>(high - low));
  }
}

// Mean of the taps; `most` is the largest count of them.
void mean_of_taps(const TextureLanes& textures, const Taps& taps, int most, Lanes& mean) {
  LevelBlend blend;
  blend_levels(textures, taps, blend);
  float any_share = 0.0F;
  for (std::size_t i = 0; i < kLanes; ++i) any_share = std::max(any_share, blend.share[i]);
  mean.fill(0.0F);
  for (int tap = 0; tap < most; ++tap) {
    BitLanes u;
    BitLanes v;
    Lanes fine_weight;
    Lanes coarse_weight;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const auto along = static_cast<float>(std::min(tap, taps.count[i] - 1));
      u[i] = tile_point((taps.first_u[i] + along * taps.step_u[i]) * textures.per_m[i]);
      v[i] = tile_point((taps.first_v[i] + along * taps.step_v[i]) * textures.per_m[i]);
      const float weight = tap < taps.count[i] ? 1.0F : 0.0F;
      coarse_weight[i] = weight * blend.share[i];
      fine_weight[i] = weight - coarse_weight[i];
    }
    add_level(textures, blend.fine, u, v, fine_weight, mean);
    if (any_share > 0.0F) add_level(textures, blend.coarse, u, v, coarse_weight, mean);
  }
  constexpr float kUnit = 1.0F / (1U << kWeightBits);
  for (std::size_t i = 0; i < kLanes; ++i)
    mean[i] *= kUnit * textures.scale[i] / static_cast<float>(taps.count[i]);
}

}  // namespace

SurfaceTable::SurfaceTable(const World& world, const SurfaceMesh& mesh) : mesh_(&mesh) {
  materials_.reserve(world.materials.size());
  for (const Material& material : world.materials)
    materials_.push_back(shading_material(world, material));
  records_.reserve(mesh_->triangles.size());
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i)
    records_.push_back(surface_record(*mesh_, i));
}

void locate(const SurfaceView& surfaces, const SurfaceHits& hits, SurfacePoints& points) {
  if (hits.surface == 0) return;
  const Gathered gathered = gather(surfaces, hits, points);
  run_wide([&] {
    set_geometry(gathered, points);
    set_footprints(gathered, points);
  });
}

Taps taps_of(const SurfacePoints& points) {
  Taps taps;
  run_wide([&] {
    for (std::size_t i = 0; i < kLanes; ++i) {
      constexpr float kMostTaps = 4.0F;
      const float ratio = points.major_m[i] / std::max(points.minor_m[i], 1e-9F);
      const auto count =
          static_cast<std::int32_t>(std::min(std::max(ratio + 0.5F, 1.0F), kMostTaps));
      const auto n = static_cast<float>(count);
      taps.count[i] = count;
      taps.width_m[i] = std::max(points.minor_m[i], points.major_m[i] / n);
      taps.step_u[i] = points.major_u[i] / n;
      taps.step_v[i] = points.major_v[i] / n;
      taps.first_u[i] = points.u[i] - 0.5F * (n - 1.0F) * taps.step_u[i];
      taps.first_v[i] = points.v[i] - 0.5F * (n - 1.0F) * taps.step_v[i];
    }
  });
  return taps;
}

Lanes gray_albedo(const SurfacePoints& points, const Taps& taps) {
  const int most = *std::max_element(taps.count.begin(), taps.count.end());
  const TextureLanes bases = textures_of(points, &ShadingMaterial::base);
  const TextureLanes details = textures_of(points, &ShadingMaterial::detail);
  Lanes tint;
  for (std::size_t i = 0; i < kLanes; ++i) tint[i] = points.material[i]->tint_luminance;
  Lanes albedo;
  run_wide([&] {
    mean_of_taps(bases, taps, most, albedo);
    for (std::size_t i = 0; i < kLanes; ++i) albedo[i] *= tint[i];
    // A sample as large as a tile of the detail averages it completely.
    float narrowest = 1.0F;
    for (std::size_t i = 0; i < kLanes; ++i)
      narrowest = std::min(narrowest, taps.width_m[i] * details.per_m[i]);
    if (!(narrowest < 1.0F)) return;
    Lanes detail;
    mean_of_taps(details, taps, most, detail);
    for (std::size_t i = 0; i < kLanes; ++i)
      detail[i] = taps.width_m[i] * details.per_m[i] < 1.0F ? 2.0F * detail[i] : 1.0F;
    for (std::size_t i = 0; i < kLanes; ++i) albedo[i] *= detail[i];
  });
  return albedo;
}

namespace {

// Moves the vertices of each object once, with all triangles that use them.
SurfaceMesh moved(const World& shapes, std::span<const SE3> poses) {
  SurfaceMesh mesh = shapes.mesh;
  std::vector<bool> is_moved(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const WorldObject& object = shapes.objects[i];
    const Eigen::Isometry3f T(poses[i].matrix().cast<float>());
    for (std::size_t t = object.first_triangle; t < object.end_triangle; ++t) {
      for (const std::uint32_t v : mesh.triangles.at(t)) {
        if (is_moved.at(v)) continue;
        is_moved[v] = true;
        mesh.vertices[v] = T * mesh.vertices[v];
        mesh.normals[v] = T.linear() * mesh.normals[v];
      }
    }
  }
  return mesh;
}

}  // namespace

MovedSurfaces::MovedSurfaces(const World& shapes, std::span<const SE3> poses)
    : mesh_(moved(shapes, poses)), surfaces_(shapes, mesh_), tracer_(mesh_) {}

}  // namespace km
