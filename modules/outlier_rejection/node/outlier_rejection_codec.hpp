#pragma once

#include <outlier_rejection.h>

#include <cstddef>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// Largest number of closures in a message; a message that claims more is refused.
inline constexpr std::size_t kMaxInliers = 1U << 16U;

/// Only robot `a` may write the set of a pair. The closures are between `a` and `b` and ascend.
template <>
struct Codec<InlierSet> : WireFormat<km_wire_InlierSet, km_wire_InlierSet_desc> {
  static constexpr const char* kTopic = "inlier_sets";
  static constexpr std::size_t kMaxBytes = 64 + 12 * kMaxInliers;

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_ClosureRef> closures;
  };
  static MessageKey key_of(const InlierSet& set);
  static Encoded encode(const InlierSet& set);
  static Decoded<InlierSet> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
