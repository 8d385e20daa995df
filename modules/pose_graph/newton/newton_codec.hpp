#pragma once

#include <newton.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/pose_graph/newton/newton_messages.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

// Bounds on what a message may claim.
inline constexpr std::size_t kMaxPublicLinks = 1U << 20U;
inline constexpr std::size_t kMaxKeptPoses = 1U << 16U;
inline constexpr std::size_t kMaxCouplings = 1U << 22U;

/// Written by the robot itself.
template <>
struct Codec<NewtonHello> {
  using Wire = km_wire_NewtonHello;
  static constexpr const char* kTopic = "newton_hello";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_NewtonHello_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_PublicLink> links;
    std::vector<std::uint32_t> poses;
    std::vector<km_wire_Pose> T_world_pose;
  };
  static Encoded encode(const NewtonHello& hello);
  static Decoded<NewtonHello> decode(const Wire& wire);
};

/// Written by the robot itself, in double precision: soft modes of a long trajectory are below
/// single precision of its stiff ones. Blocks of zeros are left out.
template <>
struct Codec<NewtonShare> {
  using Wire = km_wire_NewtonShare;
  static constexpr const char* kTopic = "newton_shares";
  static constexpr std::uint16_t kVersion = 2;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_NewtonShare_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<double> reduced;
    std::vector<double> diagonal;
    std::vector<double> coupling;
    std::vector<km_wire_KeyframeRef> kept;
    std::vector<km_wire_KeptPair> pairs;
    std::vector<std::uint8_t> present;
    std::vector<km_wire_KeptEdge> edges;
    std::vector<km_wire_SinglePose> measured;
  };
  static Encoded encode(const NewtonShare& share);
  static Decoded<NewtonShare> decode(const Wire& wire);
};

}  // namespace km
