#include "test/fuzz/all_messages.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/objects/node/objects_codec.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/robust/tree_messages.hpp"
#include "modules/security/credentials.hpp"
#include "modules/session/team_message_bytes.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/overlay/overlay.hpp"
#include "runtime/overlay/overlay_codec.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr TeamPeer kWriter{2, 70};
constexpr RobotId kReader = 5;

template <typename T>
bool accepts(std::span<const std::uint8_t> bytes) {
  WireSample sample(Codec<T>::descriptor());
  if (bytes.size() > Codec<T>::kMaxBytes || !sample.read(bytes)) return false;
  using Wire = typename Codec<T>::Wire;
  return Codec<T>::decode(*static_cast<const Wire*>(sample.get()), kWriter).value.has_value();
}

template <typename T>
MessageReader topic(const std::vector<T>& messages) {
  MessageReader reader{Codec<T>::kTopic, accepts<T>, {}};
  for (const T& message : messages) {
    const auto encoded = Codec<T>::encode(message);
    reader.samples.push_back(serialize(Codec<T>::descriptor(), &encoded.wire));
  }
  return reader;
}

OdometryPose odometry(RobotId robot, KeyframeIndex index) {
  return {{robot, index}, SE3::Identity(), Matrix6::Identity()};
}

KeyframeReply some_reply(std::size_t points) {
  KeyframeReply reply{.number = 3, .found = true, .keyframe = {}};
  reply.keyframe.odometry = odometry(kWriter.robot, 7);
  KeyframeFeatures& features = reply.keyframe.features;
  features.focal_px = 450.0;
  features.baseline_m = 0.1;
  for (std::size_t i = 0; i < points; ++i) {
    Keypoint point;
    point.bearing = {0.01F * static_cast<float>(i), -0.2F};
    point.inverse_depth = 0.5F;
    features.keypoints.push_back(point);
    features.matched.emplace_back().fill(static_cast<std::uint8_t>(i));
  }
  return reply;
}

MeshChunk some_chunk() {
  return {.key = {kWriter.robot, {1, -2, 3}, 0},
          .offsets = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 0, 9}},
          .labels = {1, 2, 3, 4},
          .faces = {{0, 1, 2}, {0, 2, 3}},
          .keyframes = mesh_keyframes(std::vector<SE3>(8, SE3::Identity())),
          .views = {{0, 0}, {0, 3}, {2, 4}, {4, 4}}};
}

template <OverlayLane kLane>
LanePacket<kLane> packet(OverlayMessage message) {
  const bool is_own = message.origin == kWriter;
  return {{kReader, std::make_shared<const OverlayMessage>(std::move(message)), is_own}};
}

MessageReader overlay_packets() {
  const auto of = [](OverlayStream stream, TeamPeer origin, Bytes content) {
    return packet<OverlayLane::kTeam>(
        {.stream = stream, .origin = origin, .content = std::move(content)});
  };
  const std::string credentials(kCredentialsLength, 'A');
  return topic<LanePacket<OverlayLane::kTeam>>(
      {of(OverlayStream::kIntroduction, {9, 1}, {'c'}),
       of(OverlayStream::kIntroduction, {9, 1}, to_octets({"c", credentials})),
       of(OverlayStream::kLinks, kWriter, encode_links({{3, 4}, {9, 1}})),
       of(OverlayStream::kSolver, kWriter, {1, 2})});
}

MessageReader relayed_packets() {
  using enum OverlayStream;
  return topic<LanePacket<OverlayLane::kPlaces>>(
      {packet<OverlayLane::kPlaces>({.stream = kClosure,
                                     .origin = {9, 1},
                                     .to = kReader,
                                     .to_boot = 70,
                                     .number = 8,
                                     .content = {4, 5}}),
       packet<OverlayLane::kPlaces>({.stream = kRequest,
                                     .origin = {9, 1},
                                     .to = kReader,
                                     .number = 3,
                                     .content = {1, 2, 3}}),
       packet<OverlayLane::kPlaces>({.stream = kBag,
                                     .origin = {9, 1},
                                     .number = 3,
                                     .is_signed = true,
                                     .content = Bytes(100, 7)})});
}

// Reader of the content of the messages of one kind.
MessageReader team_messages(const TeamMessage& message, const char* name) {
  const auto accepts = [kind = kind_of(message)](std::span<const std::uint8_t> bytes) {
    return decode_team_message({.kind = kind, .sender = kWriter, .to = kReader, .bytes = bytes})
        .value.has_value();
  };
  return {name, accepts, {encode(message)}};
}

std::vector<MessageReader> all_team_messages() {
  const TeamPeer far{9, 1};
  MemberPoses poses{.sender = kWriter,
                    .session = {kWriter, 4},
                    .stage = MemberStage::kSolved,
                    .frame = {kWriter, 4}};
  poses.keyframes = {0, 3, 200};
  poses.T_frame_kf.resize(3, SinglePose::of(SE3::Identity()));
  return {
      team_messages(TeamStatus{.sender = kWriter, .offers = {{9, 1, {2, 77}}}}, "team statuses"),
      team_messages(Session{.id = {kWriter, 4},
                            .plan = {.frame = {kWriter, 4},
                                     .members = {{kWriter, 4, {}}, {far, 3, kWriter.robot}},
                                     .pairs = {{2, 9, {1, 6}}}}},
                    "sessions"),
      team_messages(poses, "poses of members"),
      // Without bytes, which may have any length.
      team_messages(ReliableMessage{.sender = kWriter,
                                    .session = {kWriter, 4},
                                    .number = 130,
                                    .to = kReader,
                                    .bytes = {}},
                    "reliable messages"),
  };
}

UpMessage some_up_message(Eigen::Index block) {
  UpMessage message{
      .round = 3, .sums = {}, .reduced = Eigen::VectorXd::LinSpaced(2 * block, 0.0, 1.0)};
  TreeSystem system;
  system.variables = {{{2, 0}, 1, 1}, {{9, 300}, 1, 1}};
  system.pairs = {{0, 1}};
  system.schur = BlockMatrix::zero(block, 2, 1);
  for (int v = 0; v < 2; ++v) system.schur.at(v).setIdentity();
  message.system = std::move(system);
  return message;
}

}  // namespace

std::vector<MessageReader> all_messages() {
  std::vector<MessageReader> all{
      topic<KeyframeRequest>({{kWriter.robot, 1, {kReader, 4}, 17}}),
      topic<KeyframeReply>({some_reply(0), some_reply(12)}),
      topic<KeyframeWords>({{3, {kWriter.robot, 7}, {450.0, 0.1, {}}},
                            {3, {kWriter.robot, 7}, {450.0, 0.1, {{{.inverse_depth = 1.0F}, 9}}}}}),
      topic<Closure>({{.from = odometry(kWriter.robot, 1),
                       .to = odometry(kReader, 2),
                       .T_from_to = SE3::Identity(),
                       .covariance = Matrix6::Identity()}}),
      topic<InlierSet>({{.a = kWriter.robot,
                         .b = kReader,
                         .version = 1,
                         .closures = {{{2, 1}, {5, 2}}, {{2, 1}, {5, 3}}}}}),
      topic<KeyframeBow>({{.id = {kWriter.robot, 4}, .words = {{3, 1}, {900, 4}, {70000, 1}}},
                          {.id = {kWriter.robot, 5}, .words = {{3, 1}}, .normalizer = 0.25}}),
      topic<MeshChunk>({some_chunk()}),
      topic<MeshPoses>({{.robot = kWriter.robot,
                         .anchor = kReader,
                         .keyframes = mesh_keyframes(std::vector<SE3>(8, SE3::Identity()))}}),
      topic<RobotObjects>({{.robot = kWriter.robot,
                            .anchor = kReader,
                            .objects = {{.label = 7, .keyframe = 3, .size_m = {2, 1, 1}},
                                        {.label = 8, .keyframe = 4, .size_m = {1, 1, 2}}}}}),
      topic<RobotStatus>(
          {{.robot = kWriter.robot,
            .name = "beta",
            .settled_links = 3,
            .overlay =
                {.states = 5, .holds = {{{11, 12}, 13, 14}}, .own_states = 6, .missed = {11}}}}),
      overlay_packets(),
      relayed_packets()};
  for (MessageReader& reader : all_team_messages()) all.push_back(std::move(reader));
  all.push_back({"messages up",
                 [](std::span<const std::uint8_t> bytes) { return decode_up(bytes).has_value(); },
                 {encode(some_up_message(3)), encode(some_up_message(6))}});
  DownMessage down;
  down.verdict.round = 2;
  down.step = Eigen::VectorXd::LinSpaced(6, 0.0, 1.0);
  all.push_back({"messages down",
                 [](std::span<const std::uint8_t> bytes) { return decode_down(bytes).has_value(); },
                 {encode(down)}});
  all.push_back(envelope_messages());
  return all;
}

bool feed(const MessageReader& reader, std::span<const std::uint8_t> bytes) {
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::ranges::copy(bytes, exact.get());
  return reader.accepts({exact.get(), bytes.size()});
}

}  // namespace km
