#pragma once

#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/entity.hpp"

namespace km {

/// Purpose of a topic between robots; it decides the quality of service (see make_writer_qos()).
///
/// Writers of all kinds keep the last sample of each key, so that none blocks on an unreachable
/// robot. Readers keep all samples until they are taken; samples of different writers with one key
/// do not replace each other.
enum class TopicKind {
  kEvent,    ///< Every sample arrives, also at robots that join later. One key value per sample.
  kState,    ///< Reliable, newest sample of each key wins, also for robots that join later.
  kRequest,  ///< As kEvent, but dropped after dds.lease_s. One key value per sample.
  kStatus,   ///< Newest wins, may be lost, and carries the liveliness of the robot.
};

/// Category under which bytes are counted: the split of the Kimera-Multi paper, whose robots do not
/// exchange maps, and two more.
enum class TrafficCategory {
  kPlaceRecognition,
  kGeometricVerification,
  kPoseGraphOptimization,
  kMap,  ///< Meshes and objects.
  kOther
};

/// "place_recognition", "geometric_verification", "pgo", "map", "other".
const char* to_string(TrafficCategory category);

/// Quality of service of a writer, or reader, of a topic of this kind. Samples of the own
/// participant are not delivered.
[[nodiscard]] DdsQos make_writer_qos(TopicKind kind, const DdsConfig& config);
[[nodiscard]] DdsQos make_reader_qos(TopicKind kind, const DdsConfig& config);

/// True for the kinds whose writers wait for acknowledgements before they close.
[[nodiscard]] constexpr bool is_reliable(TopicKind kind) {
  return kind != TopicKind::kStatus;
}

}  // namespace km
