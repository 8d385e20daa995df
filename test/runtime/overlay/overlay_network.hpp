#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/overlay/overlay.hpp"
#include "test/modules/security/toy_team.hpp"

namespace km {

inline constexpr double kPeriod_s = 0.5;  // Period of the summaries, and of step().
inline constexpr RobotId kA = 0, kB = 1, kC = 2, kD = 3;

inline std::vector<std::uint8_t> octets(std::size_t size, std::uint8_t value = 7) {
  std::vector<std::uint8_t> content(size, value);
  return content;
}

inline std::string name_of(RobotId robot) {
  return std::string("r").append(std::to_string(robot));
}

/// Signing and checking functions of one member of a toy team.
inline OverlayKeys overlay_keys(const TeamSeal& seal) {
  return {
      .endorse = [&](OctetView statement) { return seal.endorse(statement); },
      .credentials_of = [&](const TeamPeer& peer) { return seal.credentials_of(peer); },
      .certified =
          [&](const RobotIdentity& identity, const std::string& credentials) {
            return seal.certified(identity, credentials, kToyNow_s);
          },
      .why_lapsed =
          [&](const Certificate& certificate) { return seal.why_lapsed(certificate, kToyNow_s); },
  };
}

/// Robots with links that can be cut and restored. Messages arrive at once or are lost.
class Network {
 public:
  using Links = std::vector<std::pair<RobotId, RobotId>>;

  explicit Network(RobotId robots, bool has_keys = false) : has_keys_(has_keys) {
    for (RobotId robot = 0; robot < robots; ++robot) start(robot, first_boot(robot));
  }

  /// Robots that have had these links for a while.
  Network(RobotId robots, const Links& links) : Network(robots) {
    link(links);
    run(10 * kPeriod_s);
    forget();
  }

  static std::uint64_t first_boot(RobotId robot) { return (std::uint64_t{robot} + 1) << 32U; }

  void start(RobotId robot, std::uint64_t boot) {
    boots_[robot] = boot;
    overlays_.erase(robot);
    if (has_keys_) {
      auto& member = members_[robot];
      member = member ? std::make_unique<ToyMember>(*member, boot)
                      : std::make_unique<ToyMember>(team_, robot, name_of(robot), boot);
    }
    overlays_.try_emplace(robot, TeamPeer{robot, boot}, keys_of(robot));
    read_[robot].clear();
    met_[robot].clear();
    for (const auto& [a, b] : std::set(links_))
      if (a == robot || b == robot) meet(a, b);
    settle();
  }
  void link(const Links& links) {
    links_.insert(links.begin(), links.end());
    for (const auto& [a, b] : links) meet(a, b);
    settle();
  }
  void link(RobotId a, RobotId b) { link({{a, b}}); }
  void cut(RobotId a, RobotId b) {
    links_.erase({a, b});
    at(a).lost(b, now_s_);
    at(b).lost(a, now_s_);
    settle();
  }
  // Publishes a bag to the robots that receive this one directly, as DDS does.
  void send_bag(RobotId robot, std::uint32_t index, std::size_t size = 600) {
    const auto content = signed_content({.stream = OverlayStream::kBag,
                                         .origin = {robot, boots_.at(robot)},
                                         .number = index,
                                         .content = octets(size)});
    for (auto& [other, overlay] : overlays_)
      if (linked(robot, other)) (void)overlay.keep_bag(identity(robot), index, content);
  }
  // Sends a keyframe as a reply to the robot that requested it.
  void send_reply(RobotId robot, RobotId to, std::uint32_t index) {
    const TeamPeer origin{robot, boots_.at(robot)};
    (void)at(to).keep_reply(origin, index,
                            signed_content({.stream = OverlayStream::kReply,
                                            .origin = origin,
                                            .to = to,
                                            .number = index,
                                            .content = octets(9000)}));
  }
  void publish(RobotId robot, OverlayStream stream, std::size_t size = 1) {
    at(robot).publish(stream, octets(size), now_s_);
    settle();
  }
  /// False if there is no way to the addressee.
  bool call(RobotId robot, OverlayStream stream, RobotId to) {
    const bool is_sent = at(robot).call(stream, to, 0, octets(3));
    settle();
    return is_sent;
  }
  /// Lets time pass without summaries.
  void wait(double seconds) {
    now_s_ += seconds;
    settle();
  }
  void run(double seconds, double period_s = kPeriod_s) {
    for (const double end_s = now_s_ + seconds; now_s_ < end_s;) {
      now_s_ += period_s;
      for (auto& [robot, overlay] : overlays_)
        for (auto& [other, to] : overlays_)
          if (linked(robot, other)) to.update(robot, overlay.summary(), now_s_);
      settle();
    }
  }
  /// Discards the messages so far.
  void forget() {
    read_.clear();
    packets_ = 0;
  }
  // Messages of one stream that a robot received to read, in order.
  [[nodiscard]] std::vector<std::uint32_t> read(RobotId robot, OverlayStream stream) {
    std::vector<std::uint32_t> numbers;
    for (const OverlayMessagePtr& message : read_[robot])
      if (message->stream == stream) numbers.push_back(message->number);
    return numbers;
  }
  [[nodiscard]] std::vector<OverlayMessagePtr>& all_read(RobotId robot) { return read_[robot]; }
  [[nodiscard]] const std::vector<RobotIdentity>& met(RobotId robot) { return met_[robot]; }
  [[nodiscard]] Overlay& at(RobotId robot) { return overlays_.at(robot); }
  /// Messages other than those of a robot on its own links.
  [[nodiscard]] std::size_t packets() const { return packets_; }
  /// Octets of messages that are no states.
  [[nodiscard]] std::size_t octets_sent() const { return octets_; }
  [[nodiscard]] double now_s() const { return now_s_; }
  void lose(double part) { loss_ = part; }
  /// From now on, packets of `from` do not arrive at `to`, but its summaries do.
  void jam(RobotId from, RobotId to) { jammed_.emplace(from, to); }
  void clear(RobotId from, RobotId to) { jammed_.erase({from, to}); }
  /// Robots to which a robot has renewed its DDS writers, in order.
  [[nodiscard]] const std::vector<RobotId>& renewed(RobotId robot) { return renewed_[robot]; }
  /// Team whose keys the robots use.
  [[nodiscard]] ToyTeam& team() { return team_; }
  [[nodiscard]] ToyMember& member(RobotId robot) { return *members_.at(robot); }
  /// Sets a function that changes each message that a robot sends.
  void tamper(std::function<void(OverlayMessage&)> change) { change_ = std::move(change); }
  [[nodiscard]] const std::vector<std::string>& refusals(RobotId robot) { return refusals_[robot]; }

  [[nodiscard]] RobotIdentity identity(RobotId robot) const {
    return {.robot = robot, .name = name_of(robot), .boot = boots_.at(robot)};
  }

 private:
  [[nodiscard]] bool linked(RobotId a, RobotId b) const {
    return links_.contains({a, b}) || links_.contains({b, a});
  }
  void meet(RobotId a, RobotId b) {
    if (has_keys_) {
      (void)member(a).admit(member(b));
      (void)member(b).admit(member(a));
    }
    at(a).connected(identity(b), now_s_);
    at(b).connected(identity(a), now_s_);
  }
  [[nodiscard]] std::optional<OverlayKeys> keys_of(RobotId robot) {
    return has_keys_ ? std::optional(overlay_keys(member(robot).seal)) : std::nullopt;
  }
  [[nodiscard]] std::vector<std::uint8_t> signed_content(OverlayMessage message) {
    if (has_keys_) endorse(message, *keys_of(message.origin.robot));
    return message.content;
  }
  // Delivers messages until no robot has any left to send.
  void settle() {
    for (auto& [robot, overlay] : overlays_) overlay.step(now_s_);
    for (bool more = true; more;) {
      more = false;
      for (auto& [robot, overlay] : overlays_) {
        OverlayOutput output = overlay.take_output();
        std::ranges::move(output.delivered, std::back_inserter(read_[robot]));
        std::ranges::move(output.met, std::back_inserter(met_[robot]));
        std::ranges::move(output.renewed, std::back_inserter(renewed_[robot]));
        for (const OverlayPacket& packet : output.packets) {
          more = true;
          const OverlayStream stream = packet.message->stream;
          if (stream != OverlayStream::kLinks || !packet.is_own) ++packets_;
          if (!is_state(stream)) octets_ += packet.message->content.size();
          if (!linked(robot, packet.neighbour) || uniform_(random_) < loss_ ||
              jammed_.contains({robot, packet.neighbour}))
            continue;
          OverlayMessage message = *packet.message;
          if (change_) change_(message);
          Overlay& to = at(packet.neighbour);
          if (to.receive(identity(robot),
                         std::make_shared<const OverlayMessage>(std::move(message)),
                         now_s_) == OverlayArrival::kForged)
            refusals_[packet.neighbour].emplace_back(to.refusal());
        }
      }
    }
  }

  bool has_keys_;
  ToyTeam team_;
  std::map<RobotId, std::unique_ptr<ToyMember>> members_;
  std::map<RobotId, std::uint64_t> boots_;
  std::map<RobotId, Overlay> overlays_;
  std::set<std::pair<RobotId, RobotId>> links_, jammed_;
  std::map<RobotId, std::vector<OverlayMessagePtr>> read_;
  std::map<RobotId, std::vector<RobotIdentity>> met_;
  std::map<RobotId, std::vector<RobotId>> renewed_;
  std::map<RobotId, std::vector<std::string>> refusals_;
  std::function<void(OverlayMessage&)> change_;
  std::mt19937 random_{5};
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
  double loss_ = 0.0;
  double now_s_ = 0.0;
  std::size_t packets_ = 0;
  std::size_t octets_ = 0;
};

}  // namespace km
