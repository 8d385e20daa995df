#pragma once

#include <loop_closure.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/packed_keypoints.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// Written by the requester.
template <>
struct Codec<KeyframeRequest> {
  using Wire = km_wire_KeyframeRequest;
  static constexpr const char* kTopic = "keyframe_requests";
  static constexpr std::uint16_t kVersion = 3;
  static constexpr std::size_t kMaxBytes = 64;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_KeyframeRequest_desc; }

  struct Encoded {
    Wire wire{};
  };
  static MessageKey key_of(const KeyframeRequest& request);
  static Encoded encode(const KeyframeRequest& request);
  static Decoded<KeyframeRequest> decode(const Wire& wire, const TeamPeer& writer);
};

/// Written by the owner of the keyframe.
template <>
struct Codec<KeyframeReply> {
  using Wire = km_wire_KeyframeReply;
  static constexpr const char* kTopic = "keyframe_replies";
  static constexpr std::uint16_t kVersion = 2;
  static constexpr std::size_t kMaxBytes = 1024 + (17 + kMatchedBytes) * kMaxKeypoints;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_KeyframeReply_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> features;
    std::vector<std::uint8_t> descriptors;
  };
  static MessageKey key_of(const KeyframeReply& reply);
  static Encoded encode(const KeyframeReply& reply);
  static Decoded<KeyframeReply> decode(const Wire& wire, const TeamPeer& writer);
};

/// Written by the owner of the keyframe.
template <>
struct Codec<KeyframeWords> {
  using Wire = km_wire_KeyframeWords;
  static constexpr const char* kTopic = "keyframe_words";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = 256 + 16 * kMaxKeypoints;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_KeyframeWords_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> points;
  };
  static MessageKey key_of(const KeyframeWords& words);
  static Encoded encode(const KeyframeWords& words);
  static Decoded<KeyframeWords> decode(const Wire& wire, const TeamPeer& writer);
};

/// Written by the robot that verified the closure, which owns the keyframe Closure::from.
template <>
struct Codec<Closure> {
  using Wire = km_wire_Closure;
  static constexpr const char* kTopic = "closures";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = 1024;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_Closure_desc; }

  struct Encoded {
    Wire wire{};
  };
  static MessageKey key_of(const Closure& closure);
  static Encoded encode(const Closure& closure);
  static Decoded<Closure> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
