#pragma once

#include <solver.h>

#include <cstdint>
#include <variant>
#include <vector>

#include "modules/pose_graph/newton/newton_codec.hpp"
#include "modules/pose_graph/robust/gnc_codec.hpp"
#include "modules/pose_graph/solver_message.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// Written by the robot whose message it is; what is inside is checked by its own codec. A large
/// one travels in the fragments that DDS makes of it, of which only lost ones are sent again.
template <>
struct Codec<SolverMessage> {
  using Wire = km_wire_SolverMessage;
  static constexpr const char* kTopic = "pgo_exchanges";
  static constexpr std::uint16_t kVersion = 3;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_SolverMessage_desc; }

  struct Encoded {
    Wire wire{};
    std::variant<std::monostate, Codec<NewtonHello>::Encoded, Codec<NewtonShare>::Encoded,
                 Codec<GncHello>::Encoded, Codec<GncShare>::Encoded>
        content;  // what the one element below borrows from
    std::vector<km_wire_NewtonHello> newton_hello;
    std::vector<km_wire_NewtonShare> newton_share;
    std::vector<km_wire_GncHello> gnc_hello;
    std::vector<km_wire_GncShare> gnc_share;
  };
  static Encoded encode(const SolverMessage& message);
  static Decoded<SolverMessage> decode(const Wire& wire);
};

}  // namespace km
