#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/dds/peer_table.hpp"

namespace km {

/// Programs that are noticed on the network and cannot be met, with the reasons. Logs each once
/// that stays unmet for some time, because discovery takes less, and keeps it. Time is an argument
/// [s], from the start of the robot. Not thread-safe.
class UnmetPeers {
 public:
  /// `hosts`: other hosts in dds.peers.
  explicit UnmetPeers(std::vector<std::string> hosts) : hosts_(std::move(hosts)) {}

  /// `met`: all robots met so far. `unmet`: the others, see PeerTable::unmet().
  void update(double now_s, std::span<const Peer> met, std::map<std::string, std::string> unmet);

  /// True while a robot that has nothing left to do should wait for robots that it may still meet.
  /// It waits longer if it notices one or knows its host.
  [[nodiscard]] bool awaits(double now_s) const;

  /// Reason by name, as of the last update().
  [[nodiscard]] std::map<std::string, std::string> reasons() const;

 private:
  struct Unmet {
    std::string why = {};
    double since_s = 0.0, last_s = 0.0;
    bool is_logged = false;
  };
  std::vector<std::string> hosts_;
  bool is_alone_ = true;
  std::map<std::string, Unmet> unmet_;  // by name
};

}  // namespace km
