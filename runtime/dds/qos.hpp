#pragma once

#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/topic_kind.hpp"

namespace km {

/// Quality of service of a reader and of a writer of a topic of this kind. Samples of the own
/// participant are not delivered.
[[nodiscard]] DdsQos make_topic_qos(TopicKind kind, const DdsConfig& config);

/// True for the kinds whose writers wait for acknowledgements before they close.
[[nodiscard]] constexpr bool is_reliable(TopicKind kind) {
  return kind != TopicKind::kStatus;
}

/// True for the kinds whose readers get everything from the writer's first sample on.
[[nodiscard]] constexpr bool has_full_history(TopicKind kind) {
  return kind == TopicKind::kEvent;
}

}  // namespace km
