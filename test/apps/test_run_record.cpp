#include "apps/robot/results.hpp"
#include "apps/robot/run_record.hpp"
#include "modules/session/own_graph.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

Closure closure_between(const ClosureId& id) {
  Closure closure;
  closure.from.id = id.from;
  closure.to.id = id.to;
  return closure;
}

void add_verified(const ClosureId& id, RunRecord& record) {
  record.add(closure_between(id));
  record.add(ClosureOutcome{.id = id, .stage = ClosureStage::kVerified, .reason = {}});
}

PeerEvent event_of(PeerEventKind kind, RobotId robot) {
  PeerEvent event{kind, {}, {}};
  event.identity.robot = robot;
  return event;
}

}  // namespace

TEST_CASE("a closure that the optimiser rejects is no inlier, until it is accepted again") {
  const ClosureId kept{{1, 2}, {2, 3}};
  const ClosureId doubted{{1, 4}, {2, 5}};
  const ClosureId inconsistent{{1, 6}, {2, 7}};
  RunRecord record(1);
  for (const ClosureId& id : {kept, doubted, inconsistent}) add_verified(id, record);
  record.add(InlierSet{1, 2, 1, {kept, doubted}});
  record.add(ClosureVerdicts{{{kept, true}, {doubted, false}}});

  auto outcomes = record.outcomes();
  REQUIRE(outcomes.size() == 3);
  CHECK(outcomes[0].stage == ClosureStage::kInlier);
  CHECK(outcomes[1].stage == ClosureStage::kVerified);
  CHECK(outcomes[1].reason == "rejected: the other closures contradict it");
  CHECK(outcomes[2].reason == "inconsistent with the other closures of the robot pair");
  CHECK(record.inlier_closures().size() == 1);
  const ClosureTally tally = record.closure_tallies().at(2);
  CHECK(tally.candidates == 3);
  CHECK(tally.inliers == 1);
  CHECK(tally.rejected == 1);
  CHECK(summary_of(record).closures == ClosureCounts{3, 3, 1});

  record.add(ClosureVerdicts{{{doubted, true}}});
  outcomes = record.outcomes();
  CHECK(outcomes[1].stage == ClosureStage::kInlier);
  CHECK(outcomes[1].reason.empty());
  CHECK(record.inlier_closures().size() == 2);
}

TEST_CASE("the keypoints of received keyframes are counted, descriptors of word points included") {
  RunRecord record(1);
  KeyframeReply whole{.number = 1, .found = true, .keyframe = {}};
  whole.keyframe.features.keypoints.resize(120);
  KeyframeReply completed{.number = 2, .found = true, .keyframe = {}};
  completed.keyframe.features.keypoints.resize(20);
  completed.descriptors.resize(30);
  record.add(whole);
  record.add(completed);
  record.add(KeyframeReply{.number = 3, .found = false, .keyframe = {}});
  CHECK(summary_of(record).peer_keyframes == PeerKeyframeCounts{2, 170});
}

TEST_CASE("live poses follow the last keyframe that was optimised when the image came") {
  const auto at = [](double x, double y = 0.0) {
    return make_pose(Eigen::Matrix3d::Identity(), {x, y, 0.0});
  };
  const auto state = [&](Stamp stamp, double x) {
    OdometryState made{.stamp = stamp, .T_odom_body = at(x)};
    return made;
  };
  const auto keyframe = [&](KeyframeIndex index, Stamp stamp) {
    KeyframeOdometry made;
    made.id = {1, index};
    made.stamp = stamp;
    made.T_odom_kf = at(99.0);  // odometry has refined its recent past since
    return made;
  };
  RunRecord record(1);
  record.add(state(1, 0.0));
  record.add(keyframe(0, 1));
  record.add(state(2, 1.0));
  record.add(keyframe(1, 2));
  REQUIRE(record.live().size() == 2);  // alone: odometry
  CHECK(record.live()[1].T.translation().x() == 1.0);

  // Into the frame of robot 0, which has another origin. Keyframe 2 is not optimised yet.
  record.add(Trajectory{1, 0, {at(0.0, 5.0), at(1.2, 5.0)}});
  CHECK(record.live().empty());
  record.add(state(3, 2.0));
  record.add(keyframe(2, 3));
  record.add(Trajectory{1, 0, {at(0.0, 5.0), at(1.0, 5.0), at(2.0, 5.0)}});
  record.add(state(4, 3.0));
  REQUIRE(record.live().size() == 2);
  CHECK(record.live()[0].T.translation().isApprox(Eigen::Vector3d(2.2, 5.0, 0.0)));
  CHECK(record.live()[1].T.translation().isApprox(Eigen::Vector3d(3.0, 5.0, 0.0)));

  record.add(state(4, 3.1));  // replaces that of this stamp
  REQUIRE(record.live().size() == 2);
  CHECK(record.live()[1].T.translation().isApprox(Eigen::Vector3d(3.1, 5.0, 0.0)));
}

TEST_CASE("states of a former process are not live") {
  RunRecord record(1);
  record.add(TeamSolution{.trajectory = {1, 0, {SE3::Identity()}}, .verdicts = {}, .peers = {}});
  record.add(OdometryState{});
  CHECK(record.live().empty());
  CHECK(record.odometry().size() == 1);
}

TEST_CASE("changes of decisions, poses and cells become events, each once") {
  const ClosureId kept{{1, 2}, {2, 3}}, doubted{{1, 4}, {2, 5}};
  RunRecord record(1);
  const auto judged = [&] {
    std::vector<ClosureJudgement> all;
    for (const JournalEntry& event : record.take_events())
      for (const ClosureJudgement& one : std::get<ClosureJudgements>(event).closures)
        all.push_back(one);
    return all;
  };
  record.add(InlierSet{1, 2, 1, {kept, doubted}});
  CHECK(judged() == std::vector<ClosureJudgement>{{kept, true, false}, {doubted, true, false}});
  record.add(InlierSet{1, 2, 2, {kept, doubted}});
  CHECK(judged().empty());
  record.add(ClosureVerdicts{{{kept, true}, {doubted, false}}});
  CHECK(judged() == std::vector<ClosureJudgement>{{doubted, true, true}});
  record.add(InlierSet{1, 2, 3, {kept}});
  CHECK(judged() == std::vector<ClosureJudgement>{{doubted, false, true}});

  record.add(Trajectory{1, 0, std::vector<SE3>(3, SE3::Identity())});
  CHECK(record.take_events().empty());  // poses are stated with the next sample
  record.add(RobotSample{.keyframes = 3});
  auto events = record.take_events();
  REQUIRE(events.size() == 2);
  CHECK(std::get<PoseChanges>(events[0]).poses.size() == 3);
  CHECK(std::get<RobotSample>(events[1]).keyframes == 3);
  record.add(Trajectory{1, 0, std::vector<SE3>(5001, SE3::Identity())});
  record.state_poses();
  events = record.take_events();
  REQUIRE(events.size() == 3);  // because entries of a journal have a largest size
  CHECK(std::get<PoseChanges>(events[2]).poses.capacity() < 2000);  // no copy of the other parts
  CHECK(std::get<PoseChanges>(events[2]).poses.back().id == KeyframeId{1, 5000});

  OptimizedMesh mesh;
  mesh.mesh.vertices = {{0.1F, 0.1F, 0.1F}, {0.2F, 0.1F, 0.1F}, {0.1F, 0.2F, 0.1F},
                        {5.0F, 0.1F, 0.1F}, {5.1F, 0.1F, 0.1F}, {5.0F, 0.2F, 0.1F}};
  mesh.mesh.faces = {{0, 1, 2}};
  record.add(mesh);
  mesh.mesh.faces.push_back({3, 4, 5});
  record.add(mesh);
  events = record.take_events();
  REQUIRE(events.size() == 2);
  CHECK(std::get<MeshCells>(events[0]).cells == std::vector<MeshCells::Cell>{{0, 0, 0}});
  CHECK(std::get<MeshCells>(events[1]).cells == std::vector<MeshCells::Cell>{{2, 0, 0}});
  mesh.anchor = 1;
  record.add(mesh);
  events = record.take_events();
  REQUIRE(events.size() == 1);
  CHECK(std::get<MeshCells>(events[0]).cells.size() == 2);
}

TEST_CASE("keyframes that another vocabulary keeps from being compared are counted") {
  RunRecord record(1);
  for (KeyframeIndex i = 0; i < 3; ++i)
    record.add(PlaceQuery{{2, i}, PlaceQueryStatus::kOtherVocabulary});
  record.add(PlaceQuery{{2, 3}, PlaceQueryStatus::kSearched});
  record.add(PlaceQuery{{3, 0}, PlaceQueryStatus::kRepeated});
  CHECK(record.other_vocabulary() == std::map<RobotId, std::uint64_t>{{2, 3}});
  record.add(event_of(PeerEventKind::kRestarted, 2));
  CHECK(record.other_vocabulary().empty());
}

TEST_CASE("keyframes that were compared by ORB because of another network are counted") {
  RunRecord record(1);
  KeyframeReply by_orb{.number = 1, .found = true, .keyframe = {}};
  by_orb.keyframe.odometry.id = {2, 7};
  KeyframeReply by_network = by_orb;
  by_network.keyframe.features.network = 0x1234;
  // Without a keyframe of its own, the robot does not know its network: a finished run that serves
  // others has none in this process.
  record.add(by_orb);
  record.add(by_network);
  CHECK(record.other_network().empty());
  Keyframe own;
  own.features.network = 0x1234;
  record.add(own);
  record.add(by_orb);
  record.add(by_network);
  CHECK(record.other_network() == std::map<RobotId, std::uint64_t>{{2, 1}});
  record.add(event_of(PeerEventKind::kRestarted, 2));
  CHECK(record.other_network().empty());
}

TEST_CASE("closures to one robot are recorded up to a bound") {
  RunRecord record(1);
  constexpr auto kMost = static_cast<KeyframeIndex>(OwnGraph::kMaxClosures);
  for (KeyframeIndex i = 0; i <= kMost; ++i) record.add(closure_between({{1, 0}, {2, i}}));
  record.add(closure_between({{1, 0}, {3, 0}}));
  CHECK(record.closures().size() == kMost + 1);
  CHECK_FALSE(record.closures().contains({{1, 0}, {2, kMost}}));
}

TEST_CASE("closures with a robot that restarts are dropped, those with a resumed one are kept") {
  const auto kind = GENERATE(PeerEventKind::kRestarted, PeerEventKind::kResumed);
  const ClosureId with_it{{1, 2}, {2, 3}}, doubted{{1, 4}, {2, 5}}, with_other{{1, 4}, {3, 5}};
  RunRecord record(1);
  for (const ClosureId& id : {with_it, doubted, with_other}) add_verified(id, record);
  record.add(InlierSet{1, 2, 7, {with_it, doubted}});
  record.add(InlierSet{1, 3, 7, {with_other}});
  record.add(ClosureVerdicts{{{doubted, false}}});
  record.add(event_of(kind, 2));
  if (kind == PeerEventKind::kResumed) {
    CHECK(record.inlier_closures().size() == 2);
    return;
  }
  CHECK(record.closures().size() == 1);
  CHECK(record.outcomes().size() == 1);
  CHECK(record.closure_tallies().at(3).inliers == 1);
  // In the new incarnation the same indices mean other keyframes, and versions begin again.
  for (const ClosureId& id : {with_it, doubted}) record.add(closure_between(id));
  CHECK(record.inlier_closures().size() == 1);
  record.add(InlierSet{1, 2, 1, {doubted}});
  CHECK(record.inlier_closures().size() == 2);
}

TEST_CASE("the optimiser's measurement of a pair of keyframes is recorded, not the other end's") {
  const ClosureId id{{1, 4}, {2, 3}};
  Closure precise = closure_between(id), vague = closure_between(id);
  precise.T_from_to.translation().x() = 1.0;
  vague.covariance *= 4.0;
  Closure unusable = precise;
  unusable.covariance *= 0.0;
  for (const auto& order : {std::vector{precise, vague}, std::vector{unusable, vague, precise}}) {
    RunRecord record(2);
    for (const Closure& closure : order) record.add(closure);
    record.add(InlierSet{1, 2, 1, {id}});
    REQUIRE(record.inlier_closures().size() == 1);
    CHECK(record.inlier_closures()[0].T_from_to.translation().x() == 1.0);
  }
}

TEST_CASE("a closure that only the peer has verified is none of this robot's") {
  const ClosureId id{{1, 2}, {2, 3}};
  RunRecord record(1);
  record.add(closure_between(id));
  record.add(ClosureOutcome{.id = id, .stage = ClosureStage::kReceived, .reason = {}});
  record.add(InlierSet{1, 2, 1, {id}});
  REQUIRE(record.inlier_closures().size() == 1);
  CHECK(record.closure_tallies().at(2).verified == 0);
  CHECK(record.closure_tallies().at(2).inliers == 0);
}

TEST_CASE("a closure is the same from whichever end it was found") {
  const KeyframeId low{1, 4}, high{2, 3};
  Closure closure = closure_between({high, low});
  closure.T_from_to = make_pose(Eigen::Matrix3d::Identity(), {1.0, 2.0, 3.0});
  RunRecord record(2);
  record.add(closure);
  record.add(ClosureOutcome{.id = {high, low}, .stage = ClosureStage::kVerified, .reason = {}});
  record.add(InlierSet{1, 2, 1, {closure_id(high, low)}});
  REQUIRE(record.outcomes().size() == 1);
  CHECK(record.outcomes()[0].id == ClosureId{low, high});
  CHECK(record.outcomes()[0].stage == ClosureStage::kInlier);
  CHECK(record.closure_tallies().at(1).inliers == 1);

  const TemporaryFolder folder;
  ResultWriter results;
  write_results(folder.path(), record, results);
  CHECK(results.lost().empty());
  CHECK_THAT(folder.read("loop_closures.csv"),
             Contains("\n1,4,2,3,0,inlier,0,0,-1.000000,-2.000000,-3.000000,"
                      "0.00000000,0.00000000,0.00000000,1.00000000,1,1,1,3.74,3.32,2.45,"));
}

TEST_CASE("each optimised keyframe is written with the 36 numbers of its covariance") {
  KeyframeOdometry keyframe;
  keyframe.id = {1, 0};
  RunRecord record(1);
  record.add(keyframe);
  Matrix6 Sigma = Matrix6::Identity();
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) Sigma(row, column) += 0.01 * (row + column);
  record.add(Trajectory{1, 1, {SE3::Identity()}, {Sigma}});
  const TemporaryFolder folder;
  ResultWriter results;
  write_results(folder.path(), record, results);
  std::istringstream row(folder.read("optimized_keyframes.tum"));
  double number = 0.0;
  for (int pose = 0; pose < 8; ++pose) row >> number;
  const Matrix6 along_axes = along_fixed_axes({SE3::Identity(), Sigma});
  for (const double expected : along_axes.reshaped()) {
    REQUIRE(row >> number);
    CHECK(number == Approx(expected).epsilon(1e-8));
  }
}

}  // namespace km
