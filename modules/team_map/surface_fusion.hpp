#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/semantic_mapping/marching_cubes.hpp"

namespace km {

/// Triangles of one robot near a box, in the frame of all robots.
struct RobotSurface {
  struct Triangle {
    std::array<Eigen::Vector3f, 3> corners;  ///< [m], counter-clockwise seen from free space.
    LabelId label = 0;
    std::array<LabelledMesh::Color, 3> colors = {};  ///< Colours of the corners.
  };
  RobotId robot = 0;
  std::vector<Triangle> triangles;
};

/// An edge of the grid: it begins at a voxel and runs along an axis. The fused mesh has at most one
/// vertex on it. All boxes that share the edge compute the same vertex.
struct GridEdge {
  std::array<std::int32_t, 3> voxel = {0, 0, 0};
  std::uint8_t axis = 0;
  auto operator<=>(const GridEdge&) const = default;
};

/// The fused surface of one box.
struct FusedBox {
  std::vector<GridEdge> edges;            ///< Edge of each vertex.
  std::vector<Eigen::Vector3f> vertices;  ///< [m]
  std::vector<LabelId> labels;            ///< Label of each vertex.
  std::vector<LabelledMesh::Color> colors;
  std::vector<LabelledMesh::Face> faces;
};

/// Fuses the surfaces of several robots into one, box by box.
///
/// Each robot gives each voxel near its surface the signed distance to it: the distance to the
/// nearest triangle, positive on the side of its normal. At a voxel the distances of the robots are
/// averaged, as Curless and Levoy average those of range images ("A Volumetric Method for Building
/// Complex Models from Range Images", SIGGRAPH 1996, eq. (1), with equal weights). Marching cubes
/// extract the surface of the averages. Labels are voted, one vote per robot.
///
/// A wall that is seen from both sides has two surfaces. Only surfaces with similar normals are
/// averaged: those within 60 degrees of the normal of the nearest surface. A voxel beside the
/// border of a surface has no distance if its direction from the nearest point is more than 60
/// degrees from the normal. A surface therefore grows by at most a voxel at its border.
///
/// Surface is left out where a finer one, from smaller voxels, is in the band and has a similar
/// normal.
///
/// The result depends on the triangles and their order alone, bit by bit.
class SurfaceFusion {
 public:
  static constexpr int kSide = 32;          ///< Voxels of a box along an axis.
  static constexpr float kBand_voxels = 2;  ///< Distance up to which a surface counts.
  static constexpr float kLeastCosine = 0.5F;

  /// Throws std::invalid_argument for a size of voxels that is not positive.
  explicit SurfaceFusion(double voxel_m);

  /// The box with a point [m]. Boxes are [kSide * box, kSide * (box + 1)) in voxels.
  [[nodiscard]] std::array<std::int32_t, 3> box_of(const Eigen::Vector3f& point) const;

  /// Length of a box [m].
  [[nodiscard]] float side_m() const { return kSide * voxel_m_; }
  /// Distance [m] from a box at which triangles change its surface.
  [[nodiscard]] float reach_m() const { return (kBand_voxels + 1.0F) * voxel_m_; }

  /// `surfaces`: by ascending robot, all triangles within reach_m() of the box; others do no harm.
  /// `finer`: those of smaller voxels.
  [[nodiscard]] FusedBox fuse(const std::array<std::int32_t, 3>& box,
                              std::span<const RobotSurface> surfaces,
                              std::span<const RobotSurface::Triangle> finer = {});

 private:
  static constexpr int kCorners = kSide + 1;

  // Measurement of a voxel by the surface of one robot.
  struct Observation {
    float distance_m = 0.0F;  // signed
    float cosine = -1.0F;     // between the normal and the direction to the voxel; below 0: none
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    LabelId label = 0;
    LabelledMesh::Color color = {0, 0, 0};
  };
  struct Fused {
    float distance_m = 0.0F;
    LabelId label = 0;
    LabelledMesh::Color color = {0, 0, 0};
    bool known = false;
    bool is_finer = false;  // a finer surface is here
  };

  void observe(const RobotSurface::Triangle& triangle,
               std::vector<Observation>& observations) const;
  void observe(std::span<const RobotSurface::Triangle> triangles,
               std::vector<Observation>& observations) const;
  void blend(std::span<const std::vector<Observation>> robots, std::span<const Observation> finer);
  [[nodiscard]] FusedBox extract() const;
  [[nodiscard]] Eigen::Vector3f position(int x, int y, int z) const;

  float voxel_m_;
  MarchingCubes cubes_;
  std::array<std::int32_t, 3> first_ = {0, 0, 0};  // voxel at the low corner of the box
  std::vector<std::vector<Observation>> observations_;
  std::vector<Fused> fused_;
};

}  // namespace km
