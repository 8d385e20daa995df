#pragma once

#include <pose_graph.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/pose_graph/pgo_messages.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

// Bounds on what a message may claim.
inline constexpr std::size_t kMaxTeam = 1024;
inline constexpr std::size_t kMaxPublicPoses = 1U << 20U;
inline constexpr std::uint32_t kMaxRank = 10;

/// Written by the robot itself.
template <>
struct Codec<PgoStatus> {
  using Wire = km_wire_PgoStatus;
  static constexpr const char* kTopic = "pgo_status";
  static constexpr std::uint16_t kVersion = 4;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_PgoStatus_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_EdgeSetOffer> offers;
  };
  static Encoded encode(const PgoStatus& status);
  static Decoded<PgoStatus> decode(const Wire& wire);
};

/// Written by the coordinator.
template <>
struct Codec<PgoSession> {
  using Wire = km_wire_PgoSession;
  static constexpr const char* kTopic = "pgo_sessions";
  static constexpr std::uint16_t kVersion = 3;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_PgoSession_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_SessionMember> members;
    std::vector<km_wire_SessionPair> pairs;
    std::vector<double> anchor_pose;
  };
  static Encoded encode(const PgoSession& session);
  static Decoded<PgoSession> decode(const Wire& wire);
};

/// Written by the robot whose poses they are; single precision is exact, see PgoAgent. Poses
/// are checked for numbers and shape here, for feasibility by the agent.
template <>
struct Codec<PublicPoses> {
  using Wire = km_wire_PublicPoses;
  static constexpr const char* kTopic = "pgo_poses";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_PublicPoses_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint32_t> keyframes;
    std::vector<float> poses;
  };
  static Encoded encode(const PublicPoses& poses);
  static Decoded<PublicPoses> decode(const Wire& wire);
};

/// Written by the robot whose rows and sums they are.
template <>
struct Codec<CertificateShare> {
  using Wire = km_wire_CertificateShare;
  static constexpr const char* kTopic = "pgo_certificate_shares";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_CertificateShare_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<double> rows;
    std::vector<double> sums;
  };
  static Encoded encode(const CertificateShare& share);
  static Decoded<CertificateShare> decode(const Wire& wire);
};

}  // namespace km
