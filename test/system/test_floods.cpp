#include "apps/robot/robot_config.hpp"
#include "apps/shipped_file.hpp"
#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/mesh/team_mesh.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/security/key_folder.hpp"
#include "modules/security/team_folder.hpp"
#include "modules/session/node/team_codec.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/overlay/endorsement.hpp"
#include "runtime/overlay/overlay.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/command.hpp"
#include "test/support/process.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"
#include "test/system/long_run.hpp"

// One robot of a team sends as many valid messages of one kind to a robot process as a fast radio
// link carries. Another robot sends that process a question twenty times a second. The test checks
// the cost of the flood: memory of the process, and bytes that it sends for each received byte. The
// process answers the other robot afterwards.

namespace km {
namespace {

// The counterpart of all topics of a robot (BackEnd, Mapping), with no modules behind it.
struct FloodPeer {
  // If `make_seal` is empty, messages are not encrypted.
  FloodPeer(const std::shared_ptr<const DdsDomain>& domain, const RobotIdentity& identity,
            const TestRobot::MakeSeal& make_seal)
      : participant(domain, identity, make_seal ? make_seal(identity) : nullptr),
        bridge(participant),
        status_node(
            [identity] { return RobotStatus{.robot = identity.robot, .name = identity.name}; },
            {.own = statuses.to_peers(), .peers = statuses.from_peers()}),
        peer_events(bridge.peers().events()) {
    using enum TopicKind;
    const bool has_keys = participant.seal() != nullptr;
    constexpr auto kOther = TrafficCategory::kOther;
    constexpr CrossingEnds kSends{.receive = false};
    bridge.exchange(statuses, kStatus, kOther);
    bridge.exchange(bows, kEvent, kOther, kSends, {}, unsigned_guard<KeyframeBow>(has_keys));
    bridge.exchange(requests, kRequest, kOther, kSends);
    bridge.exchange(replies, kRequest, kOther, {}, {}, unsigned_guard<KeyframeReply>(has_keys));
    bridge.exchange(closures, kEvent, kOther, kSends);
    bridge.exchange(inlier_sets, kState, kOther, kSends);
    bridge.exchange(packets, kRequest, kOther);
    bridge.exchange(chunks, kState, kOther, kSends);
  }
  ~FloodPeer() {
    status_node.stop();
    bridge.stop();
  }

  // Subscribe before.
  void start() {
    bridge.start();
    status_node.start();
  }
  [[nodiscard]] TeamPeer self() const {
    return {participant.identity().robot, participant.identity().boot};
  }
  [[nodiscard]] bool receives(RobotId robot) {
    return !peer_events
                .wait_until([&](const auto& events) {
                  return TestRobot::matching(events, PeerEventKind::kJoined, robot) > 0;
                })
                .empty();
  }
  // Sends a message of the overlay to `to`, signed if it is of this robot and the team has keys.
  void send(RobotId to, OverlayMessage message) {
    const bool is_own = message.origin == self();
    SharedSeal* seal = participant.seal();
    if (is_own && seal != nullptr) {
      OverlayKeys keys;
      keys.endorse = [seal](OctetView statement) {
        return seal->with([&](const TeamSeal& team) { return team.endorse(statement); });
      };
      endorse(message, keys);
    }
    packets.to_peers().publish(
        {to, std::make_shared<const TeamLanePacket>(TeamLanePacket{
                 {to, std::make_shared<const OverlayMessage>(std::move(message)), is_own}})});
  }
  [[nodiscard]] TrafficCount sent() const {
    TrafficCount sum;
    for (const TopicTraffic& t : bridge.traffic().topics)
      if (t.direction == Direction::kOut) {
        sum.messages += t.count.messages;
        sum.bytes += t.count.bytes;
      }
    return sum;
  }
  [[nodiscard]] std::uint64_t bytes_from(RobotId robot) const {
    std::uint64_t sum = 0;
    for (const PeerTraffic& t : bridge.traffic().peers)
      if (t.direction == Direction::kIn && t.peer == robot) sum += t.count.bytes;
    return sum;
  }

  // Room for the signature behind messages if the team has keys, without a signature in it.
  template <typename T>
  static ContentGuard<T> unsigned_guard(bool has_keys) {
    if (!has_keys) return {};
    return {.tail_bytes = kEndorsementBytes,
            .tail = [](const T&, auto) { return std::vector<std::uint8_t>(kEndorsementBytes); }};
  }

  DdsParticipant participant;
  Crossing<KeyframeBow> bows;
  AddressedCrossing<KeyframeRequest> requests;
  AddressedCrossing<KeyframeReply> replies;
  AddressedCrossing<Closure> closures;
  AddressedCrossing<InlierSet> inlier_sets;
  AddressedCrossing<TeamLanePacket> packets;
  Crossing<MeshChunk> chunks;
  Crossing<RobotStatus> statuses;
  DdsBridge bridge;
  RobotStatusNode status_node;
  Inbox<PeerEvent> peer_events;
};

constexpr RobotId kVictim = 3, kFlooder = 5, kLowFlooder = 2, kFriend = 4, kFar = 6;
constexpr std::array<RobotId, 5> kTeam{kVictim, kFlooder, kLowFlooder, kFriend, kFar};
constexpr std::uint32_t kWalk = 5000;  // keyframes of the victim

constexpr double kMaxGrowth_MB = 64.0;
// The surface of one robot may take kMaxBytesPerRobot as chunks, with all that a robot makes of it.
constexpr double kMaxSurfaceGrowth_MB =
    4.0 * static_cast<double>(TeamMesh::kMaxBytesPerRobot) / (1U << 20U);
constexpr double kMaxOutPerIn = 10.0;

// Capacity of a link.
constexpr double kMessages_Hz = 2000.0;
constexpr double kBytes_Hz = 12.5e6;
constexpr double kOutsiders_Hz = 20.0;

struct Flood {
  std::string name;
  std::function<void(FloodPeer& from, std::uint32_t number)> send;
  RobotId flooder = kFlooder;
  bool sealed = false;
  double max_growth_MB = kMaxGrowth_MB;
};

/// A process of a robot, and robots whose messages the test makes up.
TeamPeer made_up(std::uint32_t number) {
  return {static_cast<RobotId>(1000 + number % 2000), 1U + number % 2000U};
}

// Introduces the origin of a message and forwards it.
void forward(FloodPeer& from, const TeamMessage& message, std::uint32_t number) {
  OverlayMessage sent = overlay_message(message);
  if (is_state(sent.stream)) sent.number = number;
  from.send(kVictim, {.origin = sent.origin, .content = {'r'}});
  from.send(kVictim, std::move(sent));
}

Closure contradiction(std::uint32_t number) {
  Closure closure;
  closure.from.id = {kFlooder, number};
  closure.to.id = {kVictim, number % kWalk};
  for (Matrix6* covariance :
       {&closure.from.covariance, &closure.to.covariance, &closure.covariance})
    *covariance = 1e-4 * Matrix6::Identity();
  closure.T_from_to.translation() = Eigen::Vector3d(100.0 * number, 7.0 * number, 0.0);
  return closure;
}

InlierSet claimed_inliers(std::uint32_t number) {
  InlierSet set{.a = kLowFlooder, .b = kVictim, .version = number + 1, .closures = {}};
  for (std::uint32_t k = 0; k < 40000; ++k)
    set.closures.push_back({{kLowFlooder, k}, {kVictim, k % kWalk}});
  return set;
}

KeyframeBow many_words(std::uint32_t number, std::uint64_t vocabulary) {
  KeyframeBow bow{.id = {kFlooder, 2 * number}, .vocabulary = vocabulary, .words = {}};
  for (std::uint32_t k = 0; k < 900; ++k) bow.words.push_back({k, 1});
  return bow;
}

MeshChunk some_surface(std::uint32_t number) {
  MeshChunk chunk{.key = {kFlooder, {static_cast<std::int32_t>(number), 0, 0}, 0}};
  chunk.offsets.resize(2000, {1, 2, 3});
  chunk.faces.resize(2500, {0, 1, 2});
  return chunk;
}

MemberPoses many_poses(std::uint32_t number) {
  MemberPoses poses{.sender = made_up(number)};
  poses.session = {poses.sender, 1};
  for (KeyframeIndex k = 0; k < 5000; ++k) poses.keyframes.push_back(k);
  poses.T_frame_kf.resize(poses.keyframes.size());
  return poses;
}

Session large_session(std::uint32_t number) {
  Session session{.id = {made_up(number), number + 1}, .plan = {}};
  session.plan.frame = session.id;
  for (RobotId robot = 1000; robot < 1000 + kMaxTeam; ++robot)
    session.plan.members.push_back({{robot, 1}, 1, {}});
  return session;
}

std::vector<Flood> all_floods() {
  return {
      {"closures",
       [](FloodPeer& from, std::uint32_t i) {
         from.closures.to_peers().publish(
             {kVictim, std::make_shared<const Closure>(contradiction(i))});
       }},
      {"requests",
       [](FloodPeer& from, std::uint32_t i) {
         from.requests.to_peers().publish(
             {kVictim, std::make_shared<const KeyframeRequest>(
                           KeyframeRequest{kFlooder, i, {kVictim, i % kWalk}, i})});
       }},
      {"replies",
       [](FloodPeer& from, std::uint32_t i) {
         KeyframeReply reply{.number = i, .found = true, .keyframe = {}};
         reply.keyframe.odometry.id = {kFlooder, i};
         from.replies.to_peers().publish(
             {kVictim, std::make_shared<const KeyframeReply>(std::move(reply))});
       }},
      {"inlier sets",
       [](FloodPeer& from, std::uint32_t i) {
         from.inlier_sets.to_peers().publish(
             {kVictim, std::make_shared<const InlierSet>(claimed_inliers(i))});
       },
       kLowFlooder},
      {"team statuses",
       [](FloodPeer& from, std::uint32_t i) {
         forward(from, TeamStatus{.sender = made_up(i)}, i);
       }},
      {"links",
       [](FloodPeer& from, std::uint32_t i) {
         std::vector<TeamPeer> links{{kVictim, 1}};
         for (RobotId robot = 1001; robot < 1000 + kMaxTeam; ++robot) links.push_back({robot, i});
         from.send(kVictim, {.stream = OverlayStream::kLinks,
                             .origin = from.self(),
                             .number = i,
                             .content = encode_links(links)});
       }},
      {"sessions", [](FloodPeer& from, std::uint32_t i) { forward(from, large_session(i), i); }},
      {"public poses", [](FloodPeer& from, std::uint32_t i) { forward(from, many_poses(i), i); }},
      {"session messages",
       [](FloodPeer& from, std::uint32_t i) {
         forward(from,
                 ReliableMessage{.sender = made_up(i),
                                 .session = {made_up(i), 1},
                                 .number = i,
                                 .to = i % 2 == 0 ? kVictim : kFar,
                                 .bytes = std::make_shared<const std::vector<std::uint8_t>>(
                                     10000, std::uint8_t{1})},
                 i);
       }},
      {"statuses",
       [](FloodPeer& from, std::uint32_t i) {
         from.statuses.to_peers().publish(
             RobotStatus{.robot = kFlooder, .name = "flooder", .keyframes = i});
       }},
      {"identities", [](FloodPeer&, std::uint32_t) {}},  // see outsiders_main.cpp
      {"keys", [](FloodPeer& from, std::uint32_t) { from.bridge.send_keys(); }, kFlooder, true},
      {"mesh chunks",
       [](FloodPeer& from, std::uint32_t i) { from.chunks.to_peers().publish(some_surface(i)); },
       kFlooder, false, kMaxSurfaceGrowth_MB},
  };
}

double resident_MB(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024.0;
  return 0.0;
}

std::int64_t now_s() {
  return static_cast<std::int64_t>(wall_now_s());
}

// A flooded robot process, and the other robot that it serves meanwhile.
class Scene {
 public:
  Scene(const Flood& flood, const std::optional<fs::path>& images)
      : domain_(std::make_shared<const DdsDomain>(loopback_config())),
        log_(open((folder_.path() / "log").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600)),
        victim_(command(flood, images), 0, log_),
        flooder(peer(flood, flood.flooder)),
        friend_(peer(flood, kFriend)),
        far_(peer(flood, kFar)) {
    friend_.replies.from_peers().subscribe([this](const auto& reply) { reply_ = reply->number; });
    far_.packets.from_peers().subscribe([this](const auto& packet) {
      const OverlayMessage& message = *packet->message;
      if (message.stream == OverlayStream::kTeamStatus && message.origin == friend_.self())
        relayed_ = message.number;
    });
    for (FloodPeer* peer : {&flooder, &friend_, &far_}) peer->start();
    for (FloodPeer* peer : {&flooder, &friend_, &far_}) REQUIRE(peer->receives(kVictim));
    ask();
    REQUIRE(eventually([&] { return all_answered(); }));
  }

  /// Requests a keyframe, and sends a message to be forwarded.
  void ask() {
    const std::uint32_t number = ++asked_;
    friend_.requests.to_peers().publish(
        {kVictim, std::make_shared<const KeyframeRequest>(
                      KeyframeRequest{kFriend, number, {kVictim, 0}, 0})});
    OverlayMessage status =
        overlay_message(TeamStatus{.sender = friend_.self(), .keyframes = number});
    status.number = number;
    friend_.send(kVictim, std::move(status));
  }
  [[nodiscard]] bool all_answered() const { return reply_ == asked_ && relayed_ == asked_; }
  [[nodiscard]] double memory_MB() const { return resident_MB(victim_.pid()); }
  [[nodiscard]] std::uint64_t bytes_out() const {
    std::uint64_t sum = 0;
    for (const FloodPeer* peer : {&flooder, &friend_, &far_}) sum += peer->bytes_from(kVictim);
    return sum;
  }
  [[nodiscard]] std::uint64_t bytes_in() const {
    return flooder.sent().bytes + friend_.sent().bytes;
  }
  [[nodiscard]] const DdsConfig& dds() const { return domain_->config(); }
  [[nodiscard]] int interrupt() {
    victim_.kill(SIGINT);
    return victim_.wait();
  }

 private:
  [[nodiscard]] fs::path keys_of(RobotId robot) const {
    return folder_.path() / "keys" / robot_name(robot);
  }
  [[nodiscard]] FloodPeer peer(const Flood& flood, RobotId robot) const {
    const TestRobot::MakeSeal make_seal = [this](const RobotIdentity& own) {
      return std::make_shared<SharedSeal>(load_robot_keys(keys_of(own.robot)), own, now_s());
    };
    return {domain_, new_process(robot), flood.sealed ? make_seal : TestRobot::MakeSeal()};
  }
  std::vector<std::string> command(const Flood& flood, const std::optional<fs::path>& images) {
    const DdsConfig& dds = domain_->config();
    std::string line = KM_BIN_DIR "/kimera_multi_robot --robot " + std::to_string(kVictim) +
                       " --domain " + std::to_string(dds.domain) + " --output " +
                       (folder_.path() / "out").string() + " --set dds.team=" + dds.team +
                       " --set dds.interface=lo --set map.team=full";
    if (flood.sealed) {
      std::vector<RobotName> robots;
      for (const RobotId robot : kTeam) robots.push_back({robot, robot_name(robot)});
      TeamFolder::make(folder_.path() / "keys", robots, now_s(), now_s() + 3600);
      line += " --security " + keys_of(kVictim).string();
    }
    line += images
                ? " --config config/datasets/euroc.yaml --rate 0.02 --dataset " + images->string()
                : " --graph " + long_walk(folder_.path(), kVictim).string();
    return words_of(line);
  }

  TemporaryFolder folder_;
  std::shared_ptr<const DdsDomain> domain_;
  int log_;
  Process victim_;
  std::uint32_t asked_ = 0;
  std::atomic<std::uint32_t> reply_ = 0, relayed_ = 0;  // number of the last answer

 public:
  FloodPeer flooder;

 private:
  FloodPeer friend_, far_;
};

struct Costs {
  double out_per_in = 0.0;  // bytes
  double growth_MB = 0.0;
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Sends as much as the link carries.
void send_for(double seconds, const Flood& flood, FloodPeer& from) {
  const TrafficCount before = from.sent();
  const auto start = Clock::now();
  for (std::uint32_t i = 0; seconds_since(start) < seconds;) {
    const double s = seconds_since(start);
    if (i < kMessages_Hz * s &&
        static_cast<double>(from.sent().bytes - before.bytes) < kBytes_Hz * s)
      flood.send(from, i++);
    else
      std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

Costs measure(Scene& scene, const Flood& flood) {
  constexpr double kDuration_s = 0.4;
  const double before_MB = scene.memory_MB();
  const std::uint64_t in_before = scene.bytes_in(), out_before = scene.bytes_out();
  std::optional<Process> outsiders;
  if (flood.name == "identities")
    outsiders.emplace(words_of(KM_BIN_DIR "/test_outsiders " + std::to_string(scene.dds().domain) +
                               ' ' + scene.dds().team + ' ' + std::to_string(kOutsiders_Hz)),
                      0, STDOUT_FILENO);
  Costs costs;
  const auto look = [&] {
    costs.growth_MB = std::max(costs.growth_MB, scene.memory_MB() - before_MB);
  };
  std::future<void> flooding =
      std::async(std::launch::async, [&] { send_for(kDuration_s, flood, scene.flooder); });
  constexpr std::chrono::milliseconds kPeriod(50);
  while (flooding.wait_for(kPeriod) != std::future_status::ready) {
    scene.ask();
    look();
  }
  outsiders.reset();
  scene.ask();
  CHECK(eventually([&] { return scene.all_answered(); }));
  look();
  CHECK(scene.flooder.bridge.error() == nullptr);
  costs.out_per_in = static_cast<double>(scene.bytes_out() - out_before) /
                     static_cast<double>(scene.bytes_in() - in_before);
  return costs;
}

void check(const Flood& flood, const std::optional<fs::path>& images = {}) {
  CAPTURE(flood.name);
  Scene scene(flood, images);
  const Costs costs = measure(scene, flood);
  CHECK(costs.growth_MB < flood.max_growth_MB);
  CHECK(costs.out_per_in < kMaxOutPerIn);
  CHECK(scene.interrupt() == 0);
}

TEST_CASE("A flood from one robot costs a robot little, and the others next to nothing") {
  log::set_level(log::Level::kError);
  for (const Flood& flood : all_floods()) DYNAMIC_SECTION(flood.name) {
      check(flood);
    }
}

TEST_CASE("A flood of places costs little, too") {
  const auto images = shared_data("euroc/MH_01_easy");
  if (!images) return;
  log::set_level(log::Level::kError);
  const std::uint64_t vocabulary =
      load_vocabulary(find_shipped_file("vocabulary/indoor.kmvoc", "run.vocabulary")).id();
  check({.name = "bags of words",
         .send = [vocabulary](
                     FloodPeer& from,
                     std::uint32_t i) { from.bows.to_peers().publish(many_words(i, vocabulary)); }},
        images);
}

}  // namespace
}  // namespace km
