#pragma once

#include <gnc.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/pose_graph/robust/gnc_messages.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

// Bounds on what a message may claim.
inline constexpr std::size_t kMaxGncEntries = 1U << 20U;
inline constexpr std::size_t kMaxGncPairs = 1U << 19U;

/// Written by the robot itself.
template <>
struct Codec<GncHello> {
  using Wire = km_wire_GncHello;
  static constexpr const char* kTopic = "gnc_hello";
  static constexpr std::uint16_t kVersion = 2;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_GncHello_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_GncLink> links;
    std::vector<std::uint32_t> poses;
    std::vector<km_wire_Pose> T_start_pose;
    std::vector<km_wire_GncPair> pairs;
    std::vector<float> residuals;
  };
  static Encoded encode(const GncHello& hello);
  static Decoded<GncHello> decode(const Wire& wire);
};

/// Written by the robot itself.
template <>
struct Codec<GncShare> {
  using Wire = km_wire_GncShare;
  static constexpr const char* kTopic = "gnc_share";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_GncShare_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<double> reduced;
    std::vector<double> diagonal;
    std::vector<double> coupling;
    std::vector<float> residuals;
  };
  static Encoded encode(const GncShare& share);
  static Decoded<GncShare> decode(const Wire& wire);
};

}  // namespace km
