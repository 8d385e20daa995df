#pragma once

#include <cstddef>

#include "runtime/dds/qos.hpp"

namespace km {

/// Order of sending when the budget is short, most important first.
enum class SendPriority {
  kPresence,      ///< Statuses: small, and always sent.
  kClosures,      ///< Closures: sent once, and needed to join robots.
  kVerification,  ///< Requests for keyframes, and replies.
  kPoses,         ///< All messages of the pose graph.
  kWords,         ///< Bags of words.
  kBacklog,       ///< Bags of words that are not new any more.
  kMesh           ///< Chunks of the mesh, and all other messages.
};
inline constexpr std::size_t kSendPriorities = 7;

/// Priority of a topic, never kBacklog. A topic of geometric verification has the priority
/// kClosures if its kind is kEvent, otherwise kVerification.
[[nodiscard]] constexpr SendPriority priority_of(TopicKind kind, TrafficCategory category) {
  if (kind == TopicKind::kStatus) return SendPriority::kPresence;
  switch (category) {
    case TrafficCategory::kPlaceRecognition:
      return SendPriority::kWords;
    case TrafficCategory::kGeometricVerification:
      return kind == TopicKind::kEvent ? SendPriority::kClosures : SendPriority::kVerification;
    case TrafficCategory::kPoseGraphOptimization:
      return SendPriority::kPoses;
    case TrafficCategory::kMap:
    case TrafficCategory::kOther:
      break;
  }
  return SendPriority::kMesh;
}

/// Messages of this priority are sent while all sent bytes are below this share of
/// budget.bytes_per_run.
[[nodiscard]] constexpr double share_of_run(SendPriority priority) {
  switch (priority) {
    case SendPriority::kPresence:
    case SendPriority::kClosures:
      return 1.0;
    case SendPriority::kPoses:
      return 0.95;
    case SendPriority::kVerification:
      return 0.9;
    case SendPriority::kWords:
    case SendPriority::kBacklog:
      return 0.8;
    case SendPriority::kMesh:
      break;
  }
  return 0.6;
}

}  // namespace km
