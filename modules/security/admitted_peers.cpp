#include "modules/security/admitted_peers.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

namespace km {

AdmittedPeer* AdmittedPeers::find(const TeamPeer& peer) {
  const auto found = peers_.find(peer);
  return found == peers_.end() ? nullptr : &found->second.admitted;
}

const AdmittedPeer* AdmittedPeers::find(const TeamPeer& peer) const {
  const auto found = peers_.find(peer);
  return found == peers_.end() ? nullptr : &found->second.admitted;
}

void AdmittedPeers::add(const TeamPeer& peer, AdmittedPeer admitted) {
  make_room(peers_.lower_bound({peer.robot, 0}),
            peers_.upper_bound({peer.robot, std::numeric_limits<std::uint64_t>::max()}),
            kMaxAdmittedPerRobot);
  make_room(peers_.begin(), peers_.end(), kMaxAdmitted);
  peers_[peer] = {.admitted = std::move(admitted), .last_turn = ++turn_};
}

void AdmittedPeers::received(const TeamPeer& peer) {
  const auto found = peers_.find(peer);
  if (found == peers_.end()) return;
  found->second.has_sent = true;
  found->second.last_turn = ++turn_;
}

void AdmittedPeers::make_room(Entries::iterator begin, Entries::iterator end, std::size_t most) {
  if (static_cast<std::size_t>(std::distance(begin, end)) < most) return;
  peers_.erase(std::min_element(begin, end, [](const auto& a, const auto& b) {
    return std::tie(a.second.has_sent, a.second.last_turn) <
           std::tie(b.second.has_sent, b.second.last_turn);
  }));
}

}  // namespace km
