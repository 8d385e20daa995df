#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "modules/simulation/world/seeded_random.hpp"
#include "modules/simulation/world/surface_mesh.hpp"

namespace km {

/// Index into World::materials.
using MaterialId = std::uint16_t;

/// Sides of a box, to be combined with |.
enum BoxSides : unsigned {
  kSideLeft = 1U,     ///< -x
  kSideRight = 2U,    ///< +x
  kSideFront = 4U,    ///< -y
  kSideBack = 8U,     ///< +y
  kSideBottom = 16U,  ///< -z
  kSideTop = 32U,     ///< +z
  kSidesAll = 63U,
  kSidesNoBottom = 47U,  ///< What stands on something.
  kSidesAround = 15U,    ///< The four walls.
  kSidesNoBack = 55U,    ///< What is fixed to a wall at its +y side.
};

/// Collects shapes into one SurfaceMesh. Lengths in metres, coordinates in the current frame (see
/// ScopedFrame), texture coordinates in metres along the surface. Flat shapes take theirs from the
/// position in the current frame, so that the texture runs on over neighbouring pieces of one
/// plane. Triangles without area are left out.
class MeshBuilder {
 public:
  /// Pose of the current frame in the world.
  [[nodiscard]] const Eigen::Isometry3f& frame() const { return T_world_local_; }

  /// Shift of the texture of what follows [m]: likes do not look the same to the grain.
  void set_uv_offset(const Eigen::Vector2f& offset_m) { uv_offset_ = offset_m; }

  /// Corners counter-clockwise seen from outside.
  void triangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                MaterialId material);
  /// Four corners of a plane, convex, counter-clockwise seen from outside.
  void quad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
            const Eigen::Vector3f& d, MaterialId material);

  void box(const Eigen::AlignedBox3f& box, MaterialId material, unsigned sides = kSidesAll);
  void box(const Eigen::Vector3f& low, const Eigen::Vector3f& high, MaterialId material,
           unsigned sides = kSidesAll) {
    this->box(Eigen::AlignedBox3f(low, high), material, sides);
  }

  /// A simple polygon, counter-clockwise, in the plane z, facing up or down.
  void polygon(std::span<const Eigen::Vector2f> outline, float z, MaterialId material,
               bool up = true);
  /// The prism over a simple polygon, counter-clockwise, from z_low to z_high, ends closed.
  void extrude(std::span<const Eigen::Vector2f> outline, float z_low, float z_high,
               MaterialId sides, MaterialId ends);
  void extrude(std::span<const Eigen::Vector2f> outline, float z_low, float z_high,
               MaterialId material) {
    extrude(outline, z_low, z_high, material, material);
  }

  /// A cylinder or cone frustum between the centres of its ends; at least 3 segments around.
  void cylinder(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius_from,
                float radius_to, int segments, MaterialId material, bool closed = true);
  void ellipsoid(const Eigen::Vector3f& center, const Eigen::Vector3f& radii, int segments,
                 MaterialId material);
  /// The surface that `profile`, points (radius, z) in ascending z, sweeps around the z axis.
  void revolve(std::span<const Eigen::Vector2f> profile, int segments, MaterialId material);

  /// Material of a cell (row, column) of a sheet; nullopt leaves a hole.
  using CellMaterial = std::function<std::optional<MaterialId>(int, int)>;

  /// A smooth sheet of (rows + 1) x (columns + 1) points; point(row, column) gives the position,
  /// and the sheet is seen from columns x rows points (their cross product). Texture coordinates
  /// are lengths along the first row and column, or (x, y) if `flat_uv`.
  void sheet(int rows, int columns, const std::function<Eigen::Vector3f(int, int)>& point,
             const CellMaterial& material, bool flat_uv = false);
  void sheet(int rows, int columns, const std::function<Eigen::Vector3f(int, int)>& point,
             MaterialId material, bool flat_uv = false);

  struct GridPoint {
    Eigen::Vector3f position;
    Eigen::Vector3f normal;  ///< Of any length.
    Eigen::Vector2f uv;      ///< [m]
  };
  /// A sheet whose normals and texture coordinates are known.
  void grid(int rows, int columns, const std::function<GridPoint(int, int)>& point,
            const CellMaterial& material);

  /// `count` leaves of about `leaf_m` scattered within an ellipsoid, denser at its outside; their
  /// normals lean outwards, which makes the crown look round.
  void leaf_cluster(const Eigen::Vector3f& center, const Eigen::Vector3f& radii, int count,
                    float leaf_m, MaterialId material, SeededRandom& random);

  [[nodiscard]] std::size_t triangle_count() const { return mesh_.triangles.size(); }
  [[nodiscard]] const SurfaceMesh& mesh() const { return mesh_; }
  [[nodiscard]] SurfaceMesh take() { return std::move(mesh_); }

 private:
  friend class ScopedFrame;

  std::uint32_t vertex(const Eigen::Vector3f& p, const Eigen::Vector3f& n,
                       const Eigen::Vector2f& uv);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c, MaterialId material);
  void disc(const Eigen::Vector3f& center, const Eigen::Vector3f& x, const Eigen::Vector3f& y,
            int segments, MaterialId material);

  Eigen::Isometry3f T_world_local_ = Eigen::Isometry3f::Identity();
  Eigen::Vector2f uv_offset_ = Eigen::Vector2f::Zero();
  SurfaceMesh mesh_;
};

/// While it lives, the builder's current frame is a child of the former one.
class ScopedFrame {
 public:
  ScopedFrame(MeshBuilder& builder, const Eigen::Isometry3f& T_parent_child)
      : builder_(builder), T_world_parent_(builder.T_world_local_) {
    builder_.T_world_local_ = T_world_parent_ * T_parent_child;
  }
  ~ScopedFrame() { builder_.T_world_local_ = T_world_parent_; }
  ScopedFrame(const ScopedFrame&) = delete;
  ScopedFrame& operator=(const ScopedFrame&) = delete;

 private:
  MeshBuilder& builder_;
  Eigen::Isometry3f T_world_parent_;
};

/// Pose of a child that stands at `position`, turned about z [rad].
[[nodiscard]] Eigen::Isometry3f standing_at(const Eigen::Vector3f& position, float yaw_rad);

/// Texture coordinates of a point on a plane with unit normal `n`: on walls v points up, on floors
/// they are (x, y).
[[nodiscard]] Eigen::Vector2f planar_uv(const Eigen::Vector3f& p, const Eigen::Vector3f& n);

}  // namespace km
