#pragma once

#include <dds/dds.h>

#include "modules/core/decoded.hpp"

namespace km {

/// How messages of type T travel between robots. Specialised by the module that owns T, in its
/// <module>_codec.hpp:
///
///     template <>
///     struct Codec<InlierSet> {
///       using Wire = km_wire_InlierSet;                      // generated from idl/
///       static constexpr const char* kTopic = "inlier_sets"; // DDS topic name
///       static constexpr std::uint16_t kVersion = 1;         // of the wire type, idl/README.md
///       static const dds_topic_descriptor_t& descriptor() { return km_wire_InlierSet_desc; }
///
///       struct Encoded {                         // owns what `wire` points to; movable
///         Wire wire{};
///         std::vector<km_wire_ClosureRef> closures;
///       };
///       static Encoded encode(const InlierSet&);  // all but wire.header, which the writer fills
///       static Decoded<InlierSet> decode(const Wire&);  // trusts nothing; header is checked
///     };
template <typename T>
struct Codec;

}  // namespace km
