#include "test/fuzz/all_messages.hpp"

#include <algorithm>
#include <memory>
#include <random>

#include "modules/loop_closure/loop_closure_codec.hpp"
#include "modules/mesh/mesh_codec.hpp"
#include "modules/outlier_rejection/outlier_rejection_codec.hpp"
#include "modules/place_recognition/place_recognition_codec.hpp"
#include "modules/pose_graph/packet_codec.hpp"
#include "modules/pose_graph/tree_messages.hpp"
#include "modules/relay/relay_codec.hpp"
#include "modules/security/credentials.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/robot_status.hpp"

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
    features.descriptors.emplace_back().fill(static_cast<std::uint8_t>(i));
  }
  return reply;
}

MeshChunk some_chunk() {
  return {.key = {kWriter.robot, {1, -2, 3}, 0},
          .offsets = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 0, 9}},
          .labels = {1, 2, 3, 4},
          .faces = {{0, 1, 2}, {0, 2, 3}}};
}

TeamPacket packet(TeamMessage message) {
  return {kWriter.robot, std::make_shared<const TeamMessage>(std::move(message))};
}

RelayPacket relayed(RelayMessage message) {
  return {kWriter.robot, std::make_shared<const RelayMessage>(std::move(message))};
}

std::vector<TeamPacket> some_packets() {
  const TeamPeer self{kWriter.robot, kWriter.boot};
  const TeamPeer far{9, 1};
  MemberPoses poses{.sender = self,
                    .number = 2,
                    .session = {self, 4},
                    .stage = MemberStage::kSolved,
                    .frame = self};
  poses.keyframes = {0, 3, 200};
  poses.T_frame_kf.resize(3, SinglePose::of(SE3::Identity()));
  return {
      packet(TeamStatus{.sender = self,
                        .number = 3,
                        .receives = {far},
                        .frame = self,
                        .offers = {{9, 1, {2, 77}}}}),
      packet(Session{.id = {self, 4},
                     .plan = {.frame = self,
                              .members = {{self, 4, {}}, {far, 3, kWriter.robot}},
                              .pairs = {{2, 9, {1, 6}}}}}),
      packet(std::move(poses)),
      packet(ReliableMessage{.sender = self,
                             .session = {self, 4},
                             .number = 130,
                             .to = kReader,
                             .bytes = std::make_shared<const Bytes>(100, std::uint8_t{5})}),
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
      topic<Closure>({{.from = odometry(kWriter.robot, 1),
                       .to = odometry(kReader, 2),
                       .T_from_to = SE3::Identity(),
                       .covariance = Matrix6::Identity()}}),
      topic<InlierSet>({{.a = kWriter.robot,
                         .b = kReader,
                         .version = 1,
                         .closures = {{{2, 1}, {5, 2}}, {{2, 1}, {5, 3}}}}}),
      topic<KeyframeBow>({{.id = {kWriter.robot, 4}, .words = {{3, 1}, {900, 4}, {70000, 1}}}}),
      topic<MeshChunk>({some_chunk()}),
      topic<RobotStatus>({{.robot = kWriter.robot,
                           .name = "beta",
                           .settled_links = 3,
                           .relay = {.received = {kReader, 9}, .holds = {{{11, 12}, 13, 14}}}}}),
      topic<RelayPacket>(
          {relayed({.kind = RelayKind::kIntroduction, .origin = {9, 1}, .content = {'c'}}),
           relayed({.kind = RelayKind::kIntroduction,
                    .origin = {9, 1},
                    .content = to_octets({"c", std::string(kCredentialsLength, 'A')})}),
           relayed({.kind = RelayKind::kClosure,
                    .origin = {9, 1},
                    .to = kReader,
                    .to_boot = 70,
                    .number = 8,
                    .content = {4, 5}}),
           relayed({.kind = RelayKind::kRequest,
                    .origin = {9, 1},
                    .to = kReader,
                    .number = 3,
                    .content = {1, 2, 3}})}),
      topic<TeamPacket>(some_packets())};
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
