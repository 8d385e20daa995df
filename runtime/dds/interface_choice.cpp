#include "runtime/dds/interface_choice.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "modules/core/config.hpp"

namespace km {
namespace {

constexpr double kStays_s = 1.0;  // an address that is changed may be removed and added repeatedly
constexpr double kAwaited_s = 5.0;  // then any other interface is as good

// Larger for a better interface.
std::tuple<int, int, bool> rank_of(const NetworkInterface& i) {
  return {i.loopback ? 1 : i.carrier ? 2 : 0, i.routes, i.multicast};
}

}  // namespace

NetworkInterface select_interface(const std::vector<NetworkInterface>& interfaces,
                                  const std::string& name) {
  const NetworkInterface* best = nullptr;
  for (const NetworkInterface& candidate : interfaces) {
    if (!name.empty() && candidate.name != name) continue;
    if (best == nullptr || rank_of(candidate) > rank_of(*best)) best = &candidate;
  }
  if (best != nullptr) return *best;

  std::string known;
  for (const NetworkInterface& i : interfaces)
    known += (known.empty() ? "" : ", ") + i.name + " (" + i.address + ")";
  throw ConfigError(
      "dds.interface = " + (name.empty() ? "(any)" : name) +
      ": no such IPv4 interface is up; those up: " + (known.empty() ? "none" : known));
}

OtherInterfaces others_than(const NetworkInterface& chosen,
                            const std::vector<NetworkInterface>& interfaces) {
  OtherInterfaces others;
  for (const NetworkInterface& other : interfaces) {
    if (other.loopback || other == chosen) continue;
    const bool is_as_good = rank_of(other) >= rank_of(chosen);
    others.reasons += (others.reasons.empty() ? "" : ", ") + other.name +
                      (!other.carrier                 ? " has no carrier"
                       : is_as_good                   ? " is as good"
                       : other.routes < chosen.routes ? " is not on the route to other robots"
                                                      : " carries no multicast");
    others.is_clear &= !is_as_good || !other.carrier;
  }
  return others;
}

std::optional<NetworkInterface> InterfaceChoice::update(std::vector<NetworkInterface> up,
                                                        double now_s) {
  std::erase_if(up, [](const NetworkInterface& i) { return !i.carrier; });
  const bool is_gone = is_stand_in() || std::ranges::count(up, used_) == 0;
  if (is_gone && !std::exchange(waits_, is_gone)) gone_s_ = now_s;
  waits_ = is_gone;
  const auto best = is_gone ? candidate(up, now_s) : std::nullopt;
  if (best != candidate_) candidate_s_ = now_s;
  candidate_ = best;
  return best && now_s - candidate_s_ >= kStays_s ? best : std::nullopt;
}

void InterfaceChoice::moved_to(NetworkInterface used) {
  used_ = std::move(used);
  waits_ = is_stand_in();
  candidate_.reset();
}

std::optional<NetworkInterface> InterfaceChoice::candidate(const std::vector<NetworkInterface>& up,
                                                           double now_s) const {
  const std::string& name = name_.empty() && !used_.loopback ? used_.name : name_;
  const auto same = std::ranges::find(up, name, &NetworkInterface::name);
  if (same != up.end()) return *same;
  if (!name_.empty() || up.empty() || (!used_.loopback && now_s - gone_s_ < kAwaited_s))
    return std::nullopt;
  const NetworkInterface other = select_interface(up, "");
  return other.loopback ? std::nullopt : std::optional(other);
}

}  // namespace km
