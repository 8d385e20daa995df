#pragma once

#include <gnc.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/pose_graph/robust/gnc_messages.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

// Bound on what a message may claim.
inline constexpr std::size_t kMaxGncEntries = 1U << 20U;

/// Written by the robot itself.
template <>
struct Codec<GncPoses> {
  using Wire = km_wire_GncPoses;
  static constexpr const char* kTopic = "gnc_poses";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_GncPoses_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_Pose> T_world_pose;
  };
  static Encoded encode(const GncPoses& poses);
  static Decoded<GncPoses> decode(const Wire& wire);
};

/// Written by the robot itself.
template <>
struct Codec<GncResiduals> {
  using Wire = km_wire_GncResiduals;
  static constexpr const char* kTopic = "gnc_residuals";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_GncResiduals_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<float> residuals;
  };
  static Encoded encode(const GncResiduals& residuals);
  static Decoded<GncResiduals> decode(const Wire& wire);
};

}  // namespace km
