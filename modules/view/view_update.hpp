#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/core/stamp.hpp"
#include "modules/mesh/mesh_chunks.hpp"

namespace km {

/// Whom a robot hears, and since when it has not [s].
struct ViewLink {
  RobotId robot = 0;
  float silent_s = 0.0F;
};

/// A number with a name: bytes of a kind of traffic, the load of a queue.
struct ViewNumber {
  std::string name;
  double value = 0.0;
};

/// How a robot does: once a second, the newest counts.
struct ViewState {
  std::string name;
  std::string phase;            ///< "running", "finished", "settled", "leaving"
  double dataset_time_s = 0.0;  ///< Since the start of its input.
  std::uint32_t keyframes = 0;
  std::uint32_t skipped_frames = 0;
  RobotId anchor = 0;       ///< Robot whose odometry frame its optimised poses are in.
  std::uint32_t round = 0;  ///< Of optimisation.
  double cost = 0.0;        ///< Of the team's graph, see OptimizerProgress.
  double gradient_norm = 0.0;
  double cpu_s = 0.0;  ///< Of all threads, since the start.
  double resident_MB = 0.0;
  std::vector<ViewLink> links = {};
  std::vector<ViewNumber> sent_bytes = {};  ///< By kind, since the start.
  std::vector<ViewNumber> loads = {};       ///< Of modules that work: share of the time.
};

/// Where a robot is now: a few times a second, the newest counts.
struct ViewPose {
  Stamp stamp = 0;  ///< Of the image.
  SE3 T_odom_body = SE3::Identity();
};

/// Keyframes first, first + 1, ...: where odometry has them (once each), or optimisation (again
/// whenever they have moved).
struct ViewKeyframes {
  bool optimized = false;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::uint32_t first = 0;
  std::vector<SE3> T_world_kf = {};
  std::vector<Stamp> stamps = {};  ///< Of the same keyframes where odometry has them, else none.
};

/// What has become of a pair of keyframes, as its teller knows it; the newest of an id counts.
/// kVerified: not, or not yet, among those that are optimised.
enum class ViewVerdict : std::uint8_t { kCandidate, kVerified, kKept, kRejected };
struct ViewClosure {
  ClosureId id;
  ViewVerdict verdict = ViewVerdict::kCandidate;
  std::uint16_t matches = 0;
  std::uint16_t inliers = 0;
  std::string reason;  ///< Why it is rejected.
};
struct ViewClosures {
  std::vector<ViewClosure> closures;
};

/// A robot's camera image, small, and what it tracks in it. Only told to who asks.
struct ViewImage {
  Stamp stamp = 0;
  std::vector<std::uint8_t> jpeg = {};
  std::vector<std::array<float, 2>> features = {};  ///< [pixel] of the small image.
};

using ViewContent =
    std::variant<ViewState, ViewPose, ViewKeyframes, ViewClosures, MeshChunk, ViewImage>;

/// What a robot tells those who watch; they tell it nothing. Updates of one process and kind arrive
/// in the order in which they were told, and together say all: when somebody comes late, the past
/// is told again to all, so that what is known already comes a second time.
struct ViewUpdate {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Of the process: with another one, what is known of the robot goes.
  Stamp told = 0;          ///< System clock [ns].
  ViewContent content;
};

/// No content is longer; images are made to fit, and lists are cut in several.
inline constexpr std::size_t kMaxViewBytes = 60000;

/// Little-endian, poses as float32: position [m] and quaternion. Texts are of printable ASCII: what
/// is none becomes '?'. The robot and boot of a mesh chunk are the update's, and not written again.
/// Precondition: numbers are finite, closures as closure_id() has them. Throws std::length_error
/// for what is longer than kMaxViewBytes.
[[nodiscard]] std::vector<std::uint8_t> encode_view(const ViewContent& content);

/// nullopt for bytes that encode_view() does not give: cut, too long, of an unknown kind, with
/// numbers that are not finite or rotations that are none.
[[nodiscard]] std::optional<ViewContent> decode_view(std::span<const std::uint8_t> bytes);

}  // namespace km
