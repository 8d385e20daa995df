#pragma once

#include "apps/doctor/examine_recording.hpp"
#include "apps/doctor/network_facts.hpp"

namespace km {

/// Looks at the network that `config` names, for `listen_s` [s]: sends datagrams to itself, by
/// multicast and by address; listens to DDS discovery on the domains up to kLastQuietDomain, and,
/// as a participant that is no robot, on that of `config`; asks the peers for echoes. It takes part
/// in nothing. Throws DdsError if DDS refuses the configuration.
[[nodiscard]] NetworkFacts probe_network(const DdsConfig& config, double listen_s,
                                         const TellProgress& tell);

}  // namespace km
