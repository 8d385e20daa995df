#include "apps/lab/crowd/crowd_run.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "apps/lab/crowd/place_sketch.hpp"
#include "apps/lab/crowd/repeated_names.hpp"
#include "apps/lab/crowd/word_owners.hpp"
#include "modules/place_recognition/packed_bag.hpp"

namespace km {
namespace {

// Calls keyframe(robot, index, bag) for all keyframes of all robots, those of the same index
// together: the robots start at once and make keyframes at the same rate.
void play(const CrowdWorld& world, const PlaceDisguise& disguise, const auto& keyframe) {
  std::vector<CrowdReplay> replays;
  for (std::size_t robot = 0; robot < world.robots(); ++robot)
    replays.emplace_back(world, disguise, robot);
  bool any = true;
  for (KeyframeIndex index = 0; std::exchange(any, false); ++index)
    for (std::size_t robot = 0; robot < replays.size(); ++robot)
      if (const std::optional<BagOfWords> bag = replays[robot].next()) {
        any = true;
        keyframe(static_cast<RobotId>(robot), index, *bag);
      }
}

std::vector<RobotId> all_robots(const CrowdWorld& world) {
  std::vector<RobotId> robots(world.robots());
  std::iota(robots.begin(), robots.end(), RobotId{0});
  return robots;
}

std::vector<CrowdRobot> make_observed(const CrowdWorld& world, const Vocabulary& vocabulary,
                                      const CrowdObservers& observers, const CrowdMeter& meter) {
  std::vector<CrowdRobot> robots;
  for (const RobotId robot : observers.robots)
    robots.emplace_back(world, vocabulary, robot, observers.verified_share, meter);
  return robots;
}

CrowdWork mean_work(const std::vector<CrowdRobot>& robots) {
  CrowdWork mean;
  for (const CrowdRobot& robot : robots) {
    mean.cpu_s += robot.work().cpu_s / static_cast<double>(robots.size());
    mean.heap_bytes += robot.work().heap_bytes / static_cast<double>(robots.size());
  }
  return mean;
}

class OwnerTeam {
 public:
  OwnerTeam(const CrowdWorld& world, const Vocabulary& vocabulary, const CrowdObservers& observers,
            const SketchRouting& routing, const CrowdMeter& meter)
      : vocabulary_(vocabulary),
        routing_(routing),
        meter_(meter),
        robots_(all_robots(world)),
        observed_ids_(observers.robots),
        observed_(make_observed(world, vocabulary, observers, meter)) {
    for (std::size_t robot = 0; robot < world.robots(); ++robot)
      members_.push_back({.index = SketchIndex(routing.bounds, vocabulary.size()),
                          .names = RepeatedNames(routing.window)});
  }

  void add(RobotId robot, KeyframeIndex keyframe, const BagOfWords& bag) {
    Member& member = members_[robot];
    if (CrowdRobot* own = observed(robot)) own->add_own(bag, keyframe);
    Routed routed = work_.run(meter_, [&] { return route(bag); });
    for (const RobotId named : ask({robot, keyframe}, routed)) {
      ++named_;
      if (!member.names.add(named, keyframe)) continue;
      send_bag({robot, keyframe}, routed, score(routed.image, member.previous), named);
    }
    member.previous = std::move(routed.image);
    ++keyframes_;
  }

  [[nodiscard]] CrowdRun result() && {
    CrowdRun run;
    const std::size_t count = members_.size();
    for (const Member& member : members_) {
      run.sent.messages += member.sent_traffic.messages;
      run.sent.bytes += member.sent_traffic.bytes;
      run.most_received = std::max(run.most_received, member.received_traffic.bytes);
      run.sketches += static_cast<double>(member.index.size()) / static_cast<double>(count);
    }
    run.sent = {run.sent.messages / count, run.sent.bytes / count};
    run.received = run.sent;  // each message has one reader
    run.broadcast = run.sent.bytes;
    run.named = static_cast<double>(named_) / static_cast<double>(keyframes_);
    run.work = mean_work(observed_);
    run.work.cpu_s += work_.cpu_s / static_cast<double>(count);
    run.work.heap_bytes += work_.heap_bytes / static_cast<double>(count);
    run.observed = std::move(observed_);
    return run;
  }

 private:
  using Packed = std::vector<std::uint8_t>;
  struct Member {
    SketchIndex index;
    RepeatedNames names;
    BowVector previous = {};  // words of the keyframe before
    CrowdTraffic sent_traffic = {};
    CrowdTraffic received_traffic = {};
  };
  struct Routed {
    BowVector image;
    Packed bag;
    Packed sketch;
    std::vector<RobotId> owners;
  };

  CrowdRobot* observed(RobotId robot) {
    const auto found = std::ranges::find(observed_ids_, robot);
    return found == observed_ids_.end()
               ? nullptr
               : &observed_[static_cast<std::size_t>(found - observed_ids_.begin())];
  }

  [[nodiscard]] Routed route(const BagOfWords& bag) const {
    BowVector image = vocabulary_.weigh(bag);
    const BagOfWords sketch = sketch_of(bag, image, routing_.sketch);
    std::vector<RobotId> owners = owners_of(image, routing_.owners, robots_);
    return {std::move(image), pack(bag), pack(sketch), std::move(owners)};
  }

  std::set<RobotId> ask(const KeyframeId& keyframe, const Routed& routed) {
    std::set<RobotId> named;
    for (const RobotId owner : routed.owners) {
      transfer(keyframe.robot, owner, bag_bytes(routed.sketch.size()));
      const auto matches = work_.run(meter_, [&] {
        return members_[owner].index.add(keyframe,
                                         vocabulary_.weigh(unpack(routed.sketch).value()));
      });
      for (const SketchMatch& match : matches) {
        transfer(owner, keyframe.robot, answer_bytes());
        named.insert(match.keyframe.robot);
      }
    }
    return named;
  }

  void send_bag(const KeyframeId& keyframe, const Routed& routed, double normalizer, RobotId to) {
    transfer(keyframe.robot, to, bag_bytes(routed.bag.size()));
    if (CrowdRobot* robot = observed(to)) robot->receive(keyframe, routed.bag, normalizer, false);
  }

  void transfer(RobotId from, RobotId to, std::size_t content) {
    if (from == to) return;
    members_[from].sent_traffic.add(content);
    members_[to].received_traffic.add(content);
  }

  const Vocabulary& vocabulary_;
  const SketchRouting& routing_;
  const CrowdMeter& meter_;
  const std::vector<RobotId> robots_;
  const std::vector<RobotId> observed_ids_;
  std::vector<CrowdRobot> observed_;
  std::vector<Member> members_;
  CrowdWork work_;  // sum over all owners and senders
  std::size_t named_ = 0;
  std::size_t keyframes_ = 0;
};

}  // namespace

CrowdRun send_to_everyone(const CrowdWorld& world, const Vocabulary& vocabulary,
                          const PlaceDisguise& disguise, const CrowdObservers& observers,
                          const CrowdMeter& meter) {
  CrowdRun run;
  const std::size_t others = world.robots() - 1;
  std::vector<CrowdRobot> observed = make_observed(world, vocabulary, observers, meter);
  CrowdTraffic all;
  std::map<RobotId, BowVector> previous;
  play(world, disguise, [&](RobotId robot, KeyframeIndex keyframe, const BagOfWords& bag) {
    const std::vector<std::uint8_t> packed = pack(bag);
    all.add(bag_bytes(packed.size()));
    BowVector image = vocabulary.weigh(bag);
    const double normalizer = score(image, previous[robot]);
    previous[robot] = std::move(image);
    for (std::size_t i = 0; i < observed.size(); ++i)
      observers.robots[i] == robot
          ? observed[i].add_own(bag, keyframe)
          : observed[i].receive({robot, keyframe}, packed, normalizer, true);
  });
  const std::size_t own_messages = all.messages / world.robots();
  run.broadcast = all.bytes / world.robots();
  run.sent = {own_messages * others, run.broadcast * others};
  run.received = run.sent;
  run.most_received = run.received.bytes;
  run.work = mean_work(observed);
  run.named = static_cast<double>(others);
  run.observed = std::move(observed);
  return run;
}

CrowdRun send_by_owners(const CrowdWorld& world, const Vocabulary& vocabulary,
                        const PlaceDisguise& disguise, const CrowdObservers& observers,
                        const SketchRouting& routing, const CrowdMeter& meter) {
  OwnerTeam team(world, vocabulary, observers, routing, meter);
  play(world, disguise, [&](RobotId robot, KeyframeIndex keyframe, const BagOfWords& bag) {
    team.add(robot, keyframe, bag);
  });
  return std::move(team).result();
}

CrowdTraffic divided_bags(const CrowdWorld& world, const PlaceDisguise& disguise,
                          std::size_t keyframes) {
  const std::vector<RobotId> robots = all_robots(world);
  std::map<std::uint32_t, RobotId> owners;
  CrowdTraffic sent;
  for (const RobotId robot : robots) {
    CrowdReplay replay(world, disguise, robot);
    for (std::size_t i = 0; i < keyframes; ++i) {
      const BagOfWords bag = replay.next().value();
      std::map<RobotId, BagOfWords> parts;
      for (const WordCount& entry : bag) {
        const auto [owner, is_new] = owners.try_emplace(entry.word, RobotId{0});
        if (is_new) owner->second = owner_of(entry.word, robots);
        parts[owner->second].push_back(entry);
      }
      parts.erase(robot);
      for (const auto& [owner, part] : parts) {
        sent.add(bag_bytes(pack(part).size()));
        sent.add(answer_bytes());
      }
      sent.add(bag_bytes(pack(bag).size()));
    }
  }
  return {sent.messages / robots.size(), sent.bytes / robots.size()};
}

}  // namespace km
