#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "apps/lab/simulation/world/procedural_texture.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kTwoPi = 2.0F * kPi;

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
  kSidesNoBottom = 47U,  ///< For objects that stand on a surface.
  kSidesAround = 15U,    ///< The four walls.
  kSidesNoBack = 55U,    ///< For objects fixed to a wall at their +y side.
};

/// Pose of a child that stands at `position`, turned about z [rad].
[[nodiscard]] Eigen::Isometry3f standing_at(const Eigen::Vector3f& position, float yaw_rad = 0.0F);

/// A world under construction: shapes of materials, collected into one SurfaceMesh. Lengths in
/// metres, coordinates in the current frame (see at()), texture coordinates in metres along the
/// surface. Flat shapes take theirs from the position in the current frame, so that the texture
/// runs on over neighbouring pieces of one plane. Triangles without area are left out. Not
/// thread-safe.
///
/// The functions that add an object to a scene share one convention. The object stands on the plane
/// z = 0 at the origin of the current frame, and faces -y (vehicles: drive along +x). It is the
/// same for equal arguments and an equal state of `random`.
class Scene {
 public:
  /// Different seeds give different textures of the same kinds.
  explicit Scene(std::uint64_t seed = 0) : seed_(seed) {}

  /// The material of `recipe` with the recipe's natural periods times `scale`, its colours times
  /// `tint`. The same request twice gives the same index. A texture is generated when the first
  /// material needs it.
  [[nodiscard]] MaterialId paint(SurfaceClass label, Recipe recipe,
                                 const Eigen::Vector3f& tint = Eigen::Vector3f::Ones(),
                                 float scale = 1.0F, float specular = 0.0F, float glow = 0.0F);
  /// A colour without structure of its own.
  [[nodiscard]] MaterialId plain(SurfaceClass label, const Eigen::Vector3f& rgb,
                                 float specular = 0.0F) {
    return paint(label, Recipe::kPlain, rgb, 1.0F, specular);
  }

  /// During its lifetime, the current frame is a child of the former one.
  class Frame {
   public:
    Frame(Scene& scene, const Eigen::Isometry3f& T_parent_child)
        : scene_(scene), T_world_parent_(scene.T_world_local_) {
      scene_.T_world_local_ = T_world_parent_ * T_parent_child;
    }
    ~Frame() { scene_.T_world_local_ = T_world_parent_; }
    /// Adds one object: add(scene, arguments...).
    template <typename Add, typename... Arguments>
    void add(const Add& add, Arguments&&... arguments) const {
      add(scene_, std::forward<Arguments>(arguments)...);
    }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

   private:
    Scene& scene_;
    Eigen::Isometry3f T_world_parent_;
  };
  [[nodiscard]] Frame at(const Eigen::Isometry3f& T_parent_child) {
    return {*this, T_parent_child};
  }
  [[nodiscard]] Frame at(const Eigen::Vector3f& position, float yaw_rad = 0.0F) {
    return {*this, standing_at(position, yaw_rad)};
  }

  /// All shapes that are added during its lifetime are one object, with the heading of the frame in
  /// which it begins. Objects inside an object are parts of it.
  class Object {
   public:
    explicit Object(Scene& scene);
    ~Object();
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

   private:
    Scene& scene_;
  };

  /// Shift of the texture of the following shapes [m], so that equal objects differ in their grain.
  void set_uv_offset(const Eigen::Vector2f& offset_m) { uv_offset_ = offset_m; }

  /// Corners counter-clockwise seen from outside.
  void triangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                MaterialId material);
  /// Four corners of a plane, convex, counter-clockwise seen from outside.
  void quad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
            const Eigen::Vector3f& d, MaterialId material);

  void box(const Eigen::Vector3f& low, const Eigen::Vector3f& high, MaterialId material,
           unsigned sides = kSidesAll);

  /// The prism over a convex polygon, counter-clockwise, from z_low to z_high, ends closed.
  void extrude(std::span<const Eigen::Vector2f> outline, float z_low, float z_high,
               MaterialId material);

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
             MaterialId material, bool flat_uv = false) {
    sheet(
        rows, columns, point, [=](int, int) { return material; }, flat_uv);
  }

  struct GridPoint {
    Eigen::Vector3f position;
    Eigen::Vector3f normal;  ///< Any length.
    Eigen::Vector2f uv;      ///< [m]
  };
  /// A sheet whose normals and texture coordinates are known.
  void grid(int rows, int columns, const std::function<GridPoint(int, int)>& point,
            const CellMaterial& material);

  /// `count` leaves of about `leaf_m` scattered within an ellipsoid, denser at its outside; their
  /// normals lean outwards, which makes the crown look round.
  void leaf_cluster(const Eigen::Vector3f& center, const Eigen::Vector3f& radii, int count,
                    float leaf_m, MaterialId material, SeededRandom& random);

  [[nodiscard]] const SurfaceMesh& mesh() const { return mesh_; }
  /// Hands mesh, objects, materials and textures to a world. The scene is empty afterwards.
  void move_to(World& world);

 private:
  std::uint16_t texture(Recipe recipe);
  std::uint32_t vertex(const Eigen::Vector3f& p, const Eigen::Vector3f& n,
                       const Eigen::Vector2f& uv);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c, MaterialId material);
  void disc(const Eigen::Vector3f& center, const Eigen::Vector3f& x, const Eigen::Vector3f& y,
            int segments, MaterialId material);

  Eigen::Isometry3f T_world_local_ = Eigen::Isometry3f::Identity();
  Eigen::Vector2f uv_offset_ = Eigen::Vector2f::Zero();
  SurfaceMesh mesh_;
  std::uint64_t seed_;
  std::vector<Material> materials_;
  std::vector<Texture> textures_;
  std::vector<WorldObject> objects_;
  int object_depth_ = 0;      // number of present Objects
  std::vector<Recipe> made_;  // recipes of textures_, by index
};

}  // namespace km
