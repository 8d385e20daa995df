#pragma once

#include "apps/doctor/examine_recording.hpp"
#include "apps/doctor/network_facts.hpp"

namespace km {

/// Examines the network that `config` names, for `listen_s` [s]. Sends datagrams to itself, by
/// multicast and by address, and echo requests to the peers. Listens to DDS discovery on the
/// domains up to kLastQuietDomain, and on that of `config` also as a participant that is no robot.
/// It does not take part in a session. Throws DdsError if DDS refuses the configuration.
[[nodiscard]] NetworkFacts probe_network(const DdsConfig& config, double listen_s,
                                         const ReportProgress& report_progress);

}  // namespace km
