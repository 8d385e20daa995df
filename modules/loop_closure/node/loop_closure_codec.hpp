#pragma once

#include <loop_closure.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/packed_keypoints.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// Written by the requester.
template <>
struct Codec<KeyframeRequest>
    : WireFormat<km_wire_KeyframeRequest, km_wire_KeyframeRequest_desc, 3> {
  static constexpr const char* kTopic = "keyframe_requests";
  static constexpr std::size_t kMaxBytes = 64;

  static MessageKey key_of(const KeyframeRequest& request);
  static Encoded encode(const KeyframeRequest& request);
  static Decoded<KeyframeRequest> decode(const Wire& wire, const TeamPeer& writer);
};

/// Written by the owner of the keyframe.
template <>
struct Codec<KeyframeReply> : WireFormat<km_wire_KeyframeReply, km_wire_KeyframeReply_desc, 2> {
  static constexpr const char* kTopic = "keyframe_replies";
  static constexpr std::size_t kMaxBytes = 1024 + (17 + kMatchedBytes) * kMaxKeypoints;

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
struct Codec<KeyframeWords> : WireFormat<km_wire_KeyframeWords, km_wire_KeyframeWords_desc> {
  static constexpr const char* kTopic = "keyframe_words";
  static constexpr std::size_t kMaxBytes = 256 + 16 * kMaxKeypoints;

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
struct Codec<Closure> : WireFormat<km_wire_Closure, km_wire_Closure_desc> {
  static constexpr const char* kTopic = "closures";
  static constexpr std::size_t kMaxBytes = 1024;

  static MessageKey key_of(const Closure& closure);
  static Encoded encode(const Closure& closure);
  static Decoded<Closure> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
