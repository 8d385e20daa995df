#pragma once

#include "apps/doctor/examine_recording.hpp"
#include "apps/doctor/network_facts.hpp"

namespace km {

/// Examines the network of `config` for `listen_s` [s], without taking part in a session. The
/// function sends datagrams to its own host, by multicast and by address, and echo requests to the
/// peers. It listens to DDS discovery on the domains up to kLastQuietDomain, and on the domain of
/// `config` also as a participant that is no robot. Throws DdsError if DDS refuses the
/// configuration.
[[nodiscard]] NetworkFacts probe_network(const DdsConfig& config, double listen_s,
                                         const ReportProgress& report_progress);

}  // namespace km
