#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"

#include <algorithm>
#include <utility>

#include "runtime/dds/wire_pose.hpp"

namespace km {

MessageKey Codec<InlierSet>::key_of(const InlierSet& set) {
  return message_key({set.a, set.b});
}

Codec<InlierSet>::Encoded Codec<InlierSet>::encode(const InlierSet& set) {
  Encoded encoded;
  encoded.closures.reserve(set.closures.size());
  for (const ClosureId& id : set.closures)
    encoded.closures.push_back({.from = to_wire(id.from), .to = to_wire(id.to)});
  encoded.wire.a = set.a;
  encoded.wire.b = set.b;
  encoded.wire.set_version = set.version;
  borrow(encoded.wire.closures, encoded.closures);
  return encoded;
}

Decoded<InlierSet> Codec<InlierSet>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<InlierSet>;
  if (wire.a > wire.b) return Result::refuse("the pair is not in ascending order");
  if (writer.robot != wire.a) return Result::refuse("decided by another robot than the lower");
  const auto closures = elements_of(wire.closures, kMaxInliers);
  if (!closures) return Result::refuse("closures are missing or too many");

  InlierSet set{.a = wire.a, .b = wire.b, .version = wire.set_version, .closures = {}};
  set.closures.reserve(closures->size());
  for (const km_wire_ClosureRef& ref : *closures) {
    const ClosureId id{from_wire(ref.from), from_wire(ref.to)};
    const auto [low, high] = std::minmax(id.from.robot, id.to.robot);
    if (low != set.a || high != set.b) return Result::refuse("a closure of another pair");
    if (id.from == id.to) return Result::refuse("a closure from a keyframe to itself");
    if (id.to < id.from) return Result::refuse("a closure is named by its higher end first");
    if (!set.closures.empty() && !(set.closures.back() < id))
      return Result::refuse("closures are not ascending");
    set.closures.push_back(id);
  }
  return Result::accept(std::move(set));
}

}  // namespace km
