#pragma once

#include <objects.h>

#include <vector>

#include "modules/objects/map_object.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// A robot sends only its own objects. A message is refused if it has more than kMaxObjects of
/// them, or if a pose, a size or a surface is not finite, negative or too large. It is also refused
/// for more than kMaxObjectKeyframes keyframes, or one that is not of its robot. Entries of unknown
/// layers are left out.
template <>
struct Codec<RobotObjects> : WireFormat<km_wire_RobotObjects, km_wire_RobotObjects_desc, 2> {
  static constexpr const char* kTopic = "objects";
  static constexpr std::size_t kMaxBytes =
      160 * kMaxObjects + kSurfaceKeyframeBytes * kMaxObjectKeyframes;

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_SceneObject> objects;
    std::vector<km_wire_SurfaceKeyframe> keyframes;
  };
  static MessageKey key_of(const RobotObjects& /*objects*/) { return message_key({}); }
  static Encoded encode(const RobotObjects& objects);
  static Decoded<RobotObjects> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
