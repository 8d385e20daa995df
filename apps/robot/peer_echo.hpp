#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "modules/diagnosis/finding.hpp"

namespace km {

/// Result of echo requests to a peer.
struct PeerEcho {
  std::string host;
  std::size_t sent = 0, received = 0;
  double median_s = 0.0, worst_s = 0.0;  ///< Round trip time; NaN without a reply.
  bool may_send_icmp = true;             ///< False if this user has no permission for ICMP.
  int packet_bytes = 0;   ///< Largest packet that robots send to the peer [B]; 0: not tried.
  int passing_bytes = 0;  ///< Largest packet, up to this one, that the peer answers [B].
};

/// Sends `echoes` echo requests to the host (name or address, with or without ":port"), one after
/// the other. Then sends larger ones, up to `packet_bytes`, the largest packet that robots send.
[[nodiscard]] PeerEcho ask_peer(const std::string& host, int packet_bytes, std::size_t echoes);

/// The error of a path on which small packets pass and large ones do not; nullopt if all pass.
[[nodiscard]] std::optional<Finding> path_finding(const PeerEcho& peer);

}  // namespace km
