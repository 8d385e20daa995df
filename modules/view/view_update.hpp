#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/robot_sample.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/core/stamp.hpp"
#include "modules/mesh/mesh_chunks.hpp"

namespace km {

/// Present pose of a robot, sent a few times a second; the newest counts.
struct ViewPose {
  Stamp stamp = 0;  ///< Stamp of the image.
  SE3 T_odom_body = SE3::Identity();
};

/// Poses of the keyframes first, first + 1, ...: in odometry (each sent once), or optimised (sent
/// again whenever they have moved).
struct ViewKeyframes {
  bool optimized = false;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::uint32_t first = 0;
  std::vector<SE3> T_world_kf = {};
  std::vector<Stamp> stamps = {};  ///< Stamps of the same keyframes; empty for optimised poses.
};

/// Status of a closure candidate as the sending robot knows it; the newest for an id counts.
struct ViewClosure {
  ClosureId id;
  ClosureStatus verdict = ClosureStatus::kCandidate;
  std::uint16_t matches = 0;
  std::uint16_t inliers = 0;
  std::string reason;  ///< Reason of a rejection.

  bool operator==(const ViewClosure&) const = default;
};
struct ViewClosures {
  std::vector<ViewClosure> closures;
};

/// Small camera image of a robot with the features that odometry tracks. Sent only on request.
struct ViewImage {
  Stamp stamp = 0;
  std::vector<std::uint8_t> jpeg = {};
  std::vector<std::array<float, 2>> features = {};  ///< Features in the small image [pixel].
};

/// Upright box of an object in `world`, see ObjectBox.
struct ViewObject {
  LabelId label = 0;
  Eigen::Vector3f center = Eigen::Vector3f::Zero();  ///< [m]
  float yaw_rad = 0.0F;
  Eigen::Vector3f size_m = Eigen::Vector3f::Zero();
  std::vector<RobotId> robots = {};  ///< Robots that saw it.
};

/// The objects of the team as one robot knows them; the newest list in a frame counts.
struct ViewObjects {
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<ViewObject> objects = {};
  std::uint32_t left_out = 0;  ///< Number of smaller objects for which there was no room.
};

/// The 2D map in `world`; the newest counts. If several cells become one, the smallest value
/// remains.
struct ViewRaster {
  static constexpr std::uint8_t kOccupied = 0;
  static constexpr std::uint8_t kFree = 1;
  static constexpr std::uint8_t kUnknown = 255;

  static constexpr std::size_t kMaxCells = std::size_t{1} << 20U;
  static constexpr std::uint32_t kMaxSide = 4096;  ///< [cells] Browsers draw no larger images.

  RobotId anchor = 0;                       ///< Robot whose odometry frame is `world`.
  float resolution_m = 0.05F;               ///< Side of a cell.
  std::array<float, 3> origin = {0, 0, 0};  ///< Corner of cell (0, 0), and height [m].
  std::uint32_t width = 0;                  ///< [cells] along x
  std::uint32_t height = 0;                 ///< [cells] along y
  /// Runs of equal cells, row by row, x first: pairs of a length (1 to 255) and a value.
  std::vector<std::uint8_t> runs = {};
};

/// True if the raster has a size within the bounds, and runs of possible values for all its cells.
[[nodiscard]] bool is_valid(const ViewRaster& raster);

/// Values of the cells, row by row. Precondition: the raster is valid.
[[nodiscard]] std::vector<std::uint8_t> cells_of(const ViewRaster& raster);

using ViewContent = std::variant<RobotSample, ViewPose, ViewKeyframes, ViewClosures, MeshChunk,
                                 ViewImage, ViewObjects, ViewRaster>;

/// Update that a robot sends to viewers; viewers send nothing to robots. Updates of one process and
/// kind arrive in the order of sending and together contain the full state. When a viewer appears
/// late, the robot sends everything again to all viewers, so the others receive updates twice.
struct ViewUpdate {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Boot id of the process. A viewer discards the state of the robot
                           ///< when it changes.
  Stamp sent = 0;          ///< System clock [ns].
  ViewContent content;
};

/// Upper bound for all contents: images are compressed to fit, rasters are reduced, and lists are
/// split or shortened.
inline constexpr std::size_t kMaxViewBytes = 60000;

/// Little-endian, poses as float32: position [m] and quaternion. Texts are printable ASCII; any
/// other character becomes '?'. The bytes of a mesh chunk omit robot and boot id, because the
/// update states them. Precondition: numbers are finite, and closure ids are as closure_id()
/// returns them. Throws std::length_error if the content is longer than kMaxViewBytes.
[[nodiscard]] std::vector<std::uint8_t> encode_view(const ViewContent& content);

/// nullopt for bytes that encode_view() cannot produce: truncated, too long, of an unknown kind,
/// with numbers that are not finite or with invalid rotations, boxes or rasters.
[[nodiscard]] std::optional<ViewContent> decode_view(std::span<const std::uint8_t> bytes);

}  // namespace km
