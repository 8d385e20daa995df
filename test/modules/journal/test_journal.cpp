#include <sys/resource.h>

#include "modules/core/io/input_file.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/journal/journal_file.hpp"
#include "modules/journal/restored_run.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kRobot = 7;
constexpr Stamp kTime = 1'400'000'000'123'456'789;

OdometryPose some_pose(const KeyframeId& id, std::mt19937& rng) {
  return {id, random_pose(rng), random_covariance(rng, 0.1)};
}

KeyframeOdometry step(KeyframeIndex index, std::mt19937& rng) {
  KeyframeOdometry keyframe;
  keyframe.id = {kRobot, index};
  keyframe.stamp = 1000 + 100 * static_cast<Stamp>(index);
  keyframe.T_odom_kf = random_pose(rng);
  keyframe.T_previous_kf = random_pose(rng);
  keyframe.covariance = random_covariance(rng, 0.1);
  if (index % 2 == 0) keyframe.vertical = Vertical{random_vector<3>(rng).normalized(), 0.01};
  if (index % 4 > 1) return keyframe;
  UncertainCalibration& known = keyframe.calibration.emplace();
  known.calibration = {0.1 * random_vector<1>(rng)(0), random_pose(rng), 0.01};
  for (int c = 0; c < kCalibrationSize; ++c)
    known.covariance.col(c) = random_vector<kCalibrationSize>(rng);
  known.covariance = CalibrationMatrix(known.covariance * known.covariance.transpose());
  StateCovariance& covariance = keyframe.state_covariance.emplace();
  for (int c = 0; c < covariance.cols(); ++c) covariance.col(c) = random_vector<11>(rng);
  covariance = StateCovariance(covariance * covariance.transpose());
  return keyframe;
}

Keyframe features(KeyframeIndex index, std::mt19937& rng) {
  Keyframe keyframe;
  keyframe.odometry = some_pose({kRobot, index}, rng);
  keyframe.stamp = 1000 + 100 * static_cast<Stamp>(index);
  keyframe.features.T_body_cam = random_pose(rng);
  keyframe.features.focal_px = 450.0;
  keyframe.features.baseline_m = 0.11;
  keyframe.features.network = index % 2 == 0 ? 0 : 40123;
  for (int i = 0; i < 20; ++i) {
    keyframe.features.keypoints.push_back(
        {random_vector<2>(rng).cast<float>(), 0.5F, static_cast<std::uint8_t>(i % 8)});
    BinaryDescriptor& descriptor = keyframe.features.descriptors.emplace_back();
    for (std::uint8_t& byte : descriptor) byte = static_cast<std::uint8_t>(rng());
    if (keyframe.features.network != 0)
      keyframe.features.matched.emplace_back().fill(static_cast<std::uint8_t>(rng()));
  }
  return keyframe;
}

Closure closure(KeyframeIndex own, std::mt19937& rng) {
  return {some_pose({kRobot, own}, rng),
          some_pose({3, 9}, rng),
          random_pose(rng),
          random_covariance(rng, 0.1),
          40,
          0.7};
}

ClosureOutcome outcome(const KeyframeId& from, const KeyframeId& to, ClosureStage stage,
                       const std::string& reason = {}) {
  return {{from, to}, 0.7, stage, reason, 80, 40};
}

OdometryState state(Stamp stamp, std::mt19937& rng) {
  return {stamp, random_pose(rng), random_vector<3>(rng), random_vector<3>(rng),
          random_vector<3>(rng)};
}

// Five keyframes with an image between each two and a closure of each with robot 3.
std::vector<JournalEntry> some_run() {
  std::mt19937 rng(1);
  std::vector<JournalEntry> run{JournalStart{kRobot, 0x123450000, "MH_01_easy"}};
  for (KeyframeIndex i = 0; i < 5; ++i) {
    const KeyframeOdometry keyframe = step(i, rng);
    run.emplace_back(state(keyframe.stamp, rng));
    run.emplace_back(keyframe);
    run.emplace_back(state(keyframe.stamp + 50, rng));
    run.emplace_back(features(i, rng));
    run.emplace_back(ReceivedFix{keyframe.stamp + 60, random_vector<3>(rng),
                                 i % 2 == 0 ? std::nullopt : std::optional(0.3)});
    run.emplace_back(closure(i, rng));
    run.emplace_back(outcome({kRobot, i}, {3, 9}, ClosureStage::kVerified));
  }
  return run;
}

fs::path written(const TemporaryFolder& folder, const std::vector<JournalEntry>& entries) {
  fs::path file = folder.path() / "run.journal";
  JournalFile journal(file);
  for (const JournalEntry& entry : entries) journal.add(entry, kTime);
  journal.sync();
  return file;
}

std::vector<std::vector<std::uint8_t>> bytes_of(const std::vector<JournalEntry>& entries) {
  std::vector<std::vector<std::uint8_t>> bytes;
  for (const JournalEntry& entry : entries) bytes.push_back(encode_journal_entry(entry));
  return bytes;
}

std::pair<JournalExtent, std::vector<JournalEntry>> read(const fs::path& file) {
  std::vector<JournalEntry> entries;
  const JournalExtent extent = read_journal(file, [&](StoredEntry stored) {
    CHECK(stored.time == kTime);
    entries.push_back(std::move(stored.entry));
  });
  return {extent, std::move(entries)};
}

std::vector<JournalPlace> places_in(const fs::path& file) {
  std::vector<JournalPlace> places;
  (void)read_journal(file, [&](const StoredEntry& stored) { places.push_back(stored.place); });
  return places;
}

TEST_CASE("Every journal entry is restored exactly") {
  std::mt19937 rng(2);
  const KeyframeOdometry keyframe = step(4, rng);
  const auto decoded = decode_journal_entry(encode_journal_entry(keyframe));
  REQUIRE(decoded.value);
  const auto& back = std::get<KeyframeOdometry>(*decoded.value);
  CHECK(back.id == keyframe.id);
  CHECK(back.stamp == keyframe.stamp);
  CHECK(back.T_odom_kf.matrix() == keyframe.T_odom_kf.matrix());
  CHECK(back.T_previous_kf.matrix() == keyframe.T_previous_kf.matrix());
  CHECK(back.covariance.triangularView<Eigen::Upper>().toDenseMatrix() ==
        keyframe.covariance.triangularView<Eigen::Upper>().toDenseMatrix());
  CHECK(back.covariance == back.covariance.transpose());
  REQUIRE(back.vertical);
  CHECK(back.vertical->up_body == keyframe.vertical->up_body);
  REQUIRE(back.state_covariance);
  CHECK(back.state_covariance->triangularView<Eigen::Upper>().toDenseMatrix() ==
        keyframe.state_covariance->triangularView<Eigen::Upper>().toDenseMatrix());
  CHECK(*back.state_covariance == back.state_covariance->transpose());
  REQUIRE(back.calibration);
  CHECK(back.calibration->calibration.offset_s == keyframe.calibration->calibration.offset_s);
  CHECK(back.calibration->calibration.T_body_rig.matrix() ==
        keyframe.calibration->calibration.T_body_rig.matrix());
  CHECK(back.calibration->covariance.triangularView<Eigen::Upper>().toDenseMatrix() ==
        keyframe.calibration->covariance.triangularView<Eigen::Upper>().toDenseMatrix());

  std::vector<JournalEntry> run = some_run();
  run.emplace_back(PoseChanges{
      3, {{{7, 0}, random_pose(rng), random_covariance(rng, 0.1)}, {.id = {3, 70000}}}});
  run.emplace_back(ClosureJudgements{{{{{1, 2}, {7, 3}}, true, false}}});
  run.emplace_back(RobotSample{.name = "alpha", .keyframes = 5, .links = {{3, 0.5F}}});
  run.emplace_back(MeshCells{2, {{-1, 2, 1 << 30}}});
  for (const JournalEntry& entry : run) {
    const auto bytes = encode_journal_entry(entry);
    const auto again = decode_journal_entry(bytes);
    REQUIRE(again.value);
    CHECK(again.value->index() == entry.index());
    CHECK(encode_journal_entry(*again.value) == bytes);
  }
}

TEST_CASE("Bytes that are no journal entry are refused") {
  std::mt19937 rng(3);
  std::vector<std::uint8_t> bytes = encode_journal_entry(features(0, rng));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK_FALSE(decode_journal_entry(std::span(bytes).first(size)).value);
  bytes.push_back(0);
  CHECK_FALSE(decode_journal_entry(bytes).value);
  OdometryState nowhere;
  nowhere.v_odom.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(decode_journal_entry(encode_journal_entry(nowhere)).value);
  OdometryState bent, mirrored, far;
  bent.T_odom_body.linear() *= 1.01;
  mirrored.T_odom_body.linear().col(0) *= -1.0;
  far.T_odom_body.translation().z() = 1e9;
  for (const OdometryState& state : {bent, mirrored, far})
    CHECK_FALSE(decode_journal_entry(encode_journal_entry(state)).value);
  CHECK_FALSE(decode_journal_entry(std::vector<std::uint8_t>{200}).value);
  KeyframeOdometry keyframe{.id = {}, .state_covariance = 1e-4 * StateCovariance::Identity()};
  CHECK(decode_journal_entry(encode_journal_entry(keyframe)).value);
  keyframe.state_covariance = StateCovariance::Zero();  // not is_usable()
  CHECK_FALSE(decode_journal_entry(encode_journal_entry(keyframe)).value);
  bytes = encode_journal_entry(KeyframeOdometry{});
  REQUIRE(bytes.back() == 0);  // no optional part follows the step
  bytes.back() = 8;
  CHECK_FALSE(decode_journal_entry(bytes).value);
}

TEST_CASE("A truncated journal is intact up to its last full entry") {
  const TemporaryFolder folder;
  const std::vector<JournalEntry> run = some_run();
  const std::string text = (written(folder, run), folder.read("run.journal"));
  const auto expected = bytes_of(run);
  std::size_t last = 0;
  for (std::size_t size = 0; size <= text.size(); size += size < 300 ? 1 : 97) {
    const auto [extent, entries] = read(folder.write("cut", text.substr(0, size)));
    CAPTURE(size);
    CHECK(extent.whole_bytes + extent.cut_bytes == size);
    CHECK(extent.entries == entries.size());
    REQUIRE(entries.size() >= last);
    last = entries.size();
    const auto found = bytes_of(entries);
    CHECK(std::equal(found.begin(), found.end(), expected.begin()));
  }
  CHECK(read(folder.write("cut", text)).second.size() == run.size());
}

TEST_CASE("A flipped bit costs one entry, and its place is stated") {
  const TemporaryFolder folder;
  const std::vector<JournalEntry> run = some_run();
  const auto expected = bytes_of(run);
  const std::vector<JournalPlace> places = places_in(written(folder, run));
  const std::string text = folder.read("run.journal");
  std::mt19937 rng(4);
  for (int i = 0; i < 200; ++i) {
    std::string corrupted = text;
    const std::size_t at = rng() % text.size();
    CAPTURE(i, at);
    corrupted[at] = static_cast<char>(corrupted[at] ^ (1 << (rng() % 8)));
    const auto [extent, entries] = read(folder.write("corrupted", corrupted));
    REQUIRE(entries.size() == run.size() - 1);
    std::size_t hit = 0;  // The last entry whose frame begins before the flipped byte.
    constexpr std::size_t kHead = 8 + 4 + 8;
    while (hit + 1 < places.size() && places[hit + 1].offset - kHead <= at) ++hit;
    auto rest = expected;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(hit));
    CHECK(bytes_of(entries) == rest);
    if (hit + 1 == places.size()) {
      CHECK(extent.whole_bytes + extent.cut_bytes == text.size());
      CHECK(extent.cut_bytes == places[hit].bytes + kHead + 8);
      continue;
    }
    REQUIRE(extent.damages.size() == 1);
    CHECK(extent.damages[0].offset == places[hit].offset - kHead);
    CHECK(extent.damages[0].bytes == places[hit].bytes + kHead + 8);
    CHECK(extent.cut_bytes == 0);
    CHECK(extent.whole_bytes == text.size());
  }
}

TEST_CASE("Bytes with many false marks are read in little time") {
  const TemporaryFolder folder;
  std::string marks;
  for (int k = 0; k < 200000; ++k) marks += std::string("\x7FKMJRNL5\x00\x00\x20\x00", 12);
  CHECK(read(folder.write("marks", marks)).second.empty());  // otherwise 400 GB are summed up
}

// Keyframes along a line, 1 m apart, with the journal of a robot that was killed.
std::vector<JournalEntry> line_run(KeyframeIndex count) {
  std::mt19937 rng(13);
  std::vector<JournalEntry> run(2, JournalStart{kRobot, 0x123450000, "line"});
  for (KeyframeIndex i = 0; i < count; ++i) {
    KeyframeOdometry keyframe = step(i, rng);
    keyframe.T_previous_kf = make_pose(Eigen::Matrix3d::Identity(), {i == 0 ? 0.0 : 1.0, 0.0, 0.0});
    keyframe.T_odom_kf = make_pose(Eigen::Matrix3d::Identity(), {1.0 * i, 0.0, 0.0});
    run.emplace_back(state(keyframe.stamp, rng));
    run.emplace_back(keyframe);
    Keyframe full = features(i, rng);
    full.odometry.T_odom_kf = keyframe.T_odom_kf;
    run.emplace_back(std::move(full));
    run.emplace_back(closure(i, rng));
  }
  return run;
}

TEST_CASE("After damage to any one entry, the run is restored with all keyframes") {
  const TemporaryFolder folder;
  const std::vector<JournalEntry> entries = line_run(6);
  const std::vector<JournalPlace> places = places_in(written(folder, entries));
  const std::string text = folder.read("run.journal");
  for (std::size_t hit = 0; hit + 5 < entries.size(); ++hit) {
    CAPTURE(hit, entries[hit].index());
    std::string corrupted = text;
    corrupted[places[hit].offset + places[hit].bytes / 2] ^= 1;
    const RestoredRun run = restore_run(folder.write("corrupted", corrupted));
    CHECK(run.journal.damages.size() == 1);
    CHECK(run.robot == kRobot);
    CHECK(run.input == "line");
    REQUIRE(run.odometry.size() == 6);
    REQUIRE(run.keyframes.size() == 6);
    for (KeyframeIndex i = 0; i < 6; ++i) {
      CHECK(run.odometry[i].id == KeyframeId{kRobot, i});
      CHECK(run.keyframes[i].odometry.id == KeyframeId{kRobot, i});
      CHECK(run.odometry[i].T_odom_kf.translation().x() == Approx(1.0 * i).margin(1e-12));
      CHECK(run.odometry[i].T_previous_kf.translation().x() ==
            Approx(i == 0 ? 0.0 : 1.0).margin(1e-12));
      CHECK((i == 0 || run.odometry[i - 1].stamp < run.odometry[i].stamp));
    }
    const bool is_keyframe = std::holds_alternative<KeyframeOdometry>(entries[hit]) ||
                             std::holds_alternative<Keyframe>(entries[hit]);
    CHECK(run.lost_keyframes == (is_keyframe ? 1 : 0));
    const bool is_closure = std::holds_alternative<Closure>(entries[hit]);
    CHECK(run.closures.size() == (is_closure ? 5 : 6));
  }
}

TEST_CASE("Decisions and the solution are restored as they were last") {
  const TemporaryFolder folder;
  std::vector<JournalEntry> entries = some_run();
  std::mt19937 rng(14);
  const auto id = [](KeyframeIndex own) { return closure_id({kRobot, own}, {3, 9}); };
  const SE3 T = random_pose(rng);
  entries.emplace_back(JournalPeer{3, std::uint64_t{5} << kResumeBits, "carol"});
  entries.emplace_back(ClosureJudgements{{{id(0), true, false}, {id(1), true, false}}});
  entries.emplace_back(
      ClosureJudgements{{{id(1), true, true}, {id(2), true, false}, {id(0), false, false}}});
  entries.emplace_back(ClosureJudgements{{{closure_id({kRobot, 1}, {3, 77}), true, false}}});
  entries.emplace_back(PoseChanges{kRobot, {{{kRobot, 4}, T, {}}}});
  entries.emplace_back(PoseChanges{3, {{{kRobot, 0}, random_pose(rng), {}}, {{kRobot, 1}, T, {}}}});
  entries.emplace_back(PoseChanges{3, {{{3, 9}, T, {}}, {{kRobot, 0}, T, {}}}});
  const RestoredRun run = restore_run(written(folder, entries));
  REQUIRE(run.inlier_sets.size() == 1);
  CHECK(run.inlier_sets[0].a == 3);
  CHECK(run.inlier_sets[0].b == kRobot);
  CHECK(run.inlier_sets[0].closures == std::vector<ClosureId>{id(1), id(2)});
  REQUIRE(run.solution.verdicts.closures.size() == 2);
  CHECK_FALSE(run.solution.verdicts.closures[0].kept);
  CHECK(run.solution.verdicts.closures[1].kept);
  CHECK(run.solution.trajectory.anchor == 3);
  REQUIRE(run.solution.trajectory.T_world_kf.size() == 2);
  CHECK(run.solution.trajectory.T_world_kf[0].matrix() == T.matrix());
  CHECK(run.solution.trajectory.public_poses.at({3, 9}).matrix() == T.matrix());
  REQUIRE(run.solution.peers.size() == 1);
  CHECK(run.solution.peers[0].boot >> kResumeBits == 5);

  entries.emplace_back(JournalPeer{3, std::uint64_t{6} << kResumeBits, "carol"});
  const RestoredRun after = restore_run(written(folder, entries));
  CHECK(after.inlier_sets.empty());
  CHECK(after.solution.trajectory.public_poses.empty());
  CHECK(after.solution.trajectory.T_world_kf.size() == 2);
}

TEST_CASE("Files that are no journals are refused by name") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(restore_run(folder.write("notes.txt", "Dear diary, today...")),
                    Contains("notes.txt") && Contains("no journal"));
  CHECK_THROWS_AS(restore_run(folder.path() / "missing"), InputFileError);
  CHECK(restore_run(folder.write("empty", "")).keyframes.empty());
  CHECK(restore_run(folder.write("begun", "\x7FKMJ")).keyframes.empty());
}

TEST_CASE("A continued journal loses its incomplete end and grows") {
  const TemporaryFolder folder;
  const std::vector<JournalEntry> run = some_run();
  const fs::path file = written(folder, run);
  fs::resize_file(file, fs::file_size(file) - 3);
  const auto [extent, entries] = read(file);
  REQUIRE(entries.size() == run.size() - 1);
  {
    JournalFile again(file, extent);
    again.add(JournalStart{kRobot, 0x123450001, "MH_01_easy"}, kTime);
    again.sync();
    std::mt19937 rng(5);
    again.add(step(5, rng), kTime);
    again.sync();
  }
  const auto [whole, all] = read(file);
  CHECK(whole.cut_bytes == 0);
  REQUIRE(all.size() == run.size() + 1);
  CHECK(std::get<JournalStart>(all[run.size() - 1]).boot == 0x123450001);
}

TEST_CASE("An entry can be read at the place that add() returned") {
  const TemporaryFolder folder;
  const std::vector<JournalEntry> run = some_run();
  const fs::path file = written(folder, run);
  std::vector<JournalPlace> places;
  const JournalExtent extent =
      read_journal(file, [&](const StoredEntry& stored) { places.push_back(stored.place); });
  JournalFile again(file, extent);
  for (const JournalEntry& entry : run) places.push_back(again.add(entry, kTime).value());
  CHECK_THROWS_WITH(read_journal_entry(file, places.back()), Contains("run.journal"));
  again.sync();
  for (std::size_t i = 0; i < places.size(); ++i)
    CHECK(encode_journal_entry(read_journal_entry(file, places[i])) ==
          encode_journal_entry(run[i % run.size()]));
  const RestoredRun restored = restore_run(written(folder, run));
  REQUIRE(restored.places.size() == restored.keyframes.size());
  for (std::size_t k = 0; k < restored.places.size(); ++k)
    CHECK(encode_journal_entry(read_journal_entry(file, restored.places[k])) ==
          encode_journal_entry(restored.keyframes[k]));
  places.front().bytes += 1;
  CHECK_THROWS_AS(read_journal_entry(file, places.front()), InputFileError);
  CHECK_THROWS_AS(read_journal_entry(folder.path() / "missing", places[1]), InputFileError);
}

TEST_CASE("A disk that is full for a while loses no entry") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "run.journal";
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &limit) == 0);
  const std::vector<JournalEntry> run = some_run();
  {
    JournalFile journal(file);
    for (const JournalEntry& entry : run) journal.add(entry, kTime);
    const rlimit small{1000, limit.rlim_max};
    REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
    CHECK_THROWS_AS(journal.sync(), std::system_error);
    CHECK_THROWS_WITH(journal.sync(), Contains("run.journal"));
    REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
    CHECK(fs::file_size(file) <= 1000);
    journal.sync();
    CHECK(journal.is_whole());
  }
  std::signal(SIGXFSZ, before);
  CHECK(bytes_of(read(file).second) == bytes_of(run));
}

TEST_CASE("A run is restored up to its last full keyframe") {
  const TemporaryFolder folder;
  std::vector<JournalEntry> entries = some_run();
  std::mt19937 rng(6);
  entries.emplace_back(step(5, rng));  // a step whose features did not reach the disk
  entries.emplace_back(closure(5, rng));
  entries.emplace_back(outcome({kRobot, 1}, {3, 4}, ClosureStage::kRequested));
  entries.emplace_back(outcome({kRobot, 2}, {3, 4}, ClosureStage::kReceived, "too few matches"));
  entries.emplace_back(outcome({kRobot, 3}, {3, 4}, ClosureStage::kVerified));  // an outcome
                                                                                // without its
                                                                                // closure
  const RestoredRun run = restore_run(written(folder, entries));
  CHECK(run.robot == kRobot);
  CHECK(run.input == "MH_01_easy");
  REQUIRE(run.odometry.size() == 5);
  CHECK(run.keyframes.size() == 5);
  CHECK(run.states.size() == 10);  // the image after the last keyframe may not come again
  CHECK(run.final_states() == 9);
  CHECK(run.states[8].stamp == run.odometry.back().stamp);
  CHECK(run.closures.size() == 5);
  CHECK(run.fixes.size() == 5);
  REQUIRE(run.outcomes.size() == 6);
  CHECK(run.outcomes[2].reason == "too few matches");
}

TEST_CASE("A run continues after its last full keyframe each time it is killed") {
  const TemporaryFolder folder;
  std::vector<JournalEntry> entries = some_run();
  std::mt19937 rng(7);
  for (std::uint64_t process = 1; process <= 3; ++process) {
    entries.emplace_back(step(4 + static_cast<KeyframeIndex>(process), rng));  // incomplete
    entries.emplace_back(JournalStart{kRobot, 0x123450000 + process, "MH_01_easy"});
    const KeyframeOdometry next = step(4 + static_cast<KeyframeIndex>(process), rng);
    entries.emplace_back(state(next.stamp, rng));
    entries.emplace_back(next);
    entries.emplace_back(features(next.id.index, rng));
    const RestoredRun run = restore_run(written(folder, entries));
    CHECK(run.boot == 0x123450000 + process);
    REQUIRE(run.odometry.size() == 5 + process);
    CHECK(run.odometry.back().T_odom_kf.matrix() == next.T_odom_kf.matrix());
    CHECK(run.states.size() == 10 + process);  // next.stamp is later than that of the former image
  }
}

TEST_CASE("Closures with another robot end with its incarnation") {
  const TemporaryFolder folder;
  std::vector<JournalEntry> entries = some_run();
  const std::uint64_t boot = std::uint64_t{5} << kResumeBits;
  entries.insert(entries.begin() + 1, JournalPeer{3, boot, "carol"});
  CHECK(restore_run(written(folder, entries)).closures.size() == 5);
  entries.emplace_back(JournalPeer{3, boot + 1, "carol"});  // resumed
  CHECK(restore_run(written(folder, entries)).closures.size() == 5);
  entries.emplace_back(JournalPeer{3, std::uint64_t{6} << kResumeBits, "carol"});
  std::mt19937 rng(9);
  entries.emplace_back(closure(2, rng));
  const RestoredRun run = restore_run(written(folder, entries));
  CHECK(run.closures.size() == 1);
  CHECK(run.outcomes.empty());
  CHECK(run.peers.at(3).boot >> kResumeBits == 6);
  CHECK(run.keyframes.size() == 5);
}

TEST_CASE("A finished run under another id keeps only its own results") {
  const TemporaryFolder folder;
  std::vector<JournalEntry> entries = some_run();
  std::mt19937 rng(10);
  Closure inside = closure(4, rng);
  inside.to.id = {kRobot, 1};
  entries.emplace_back(inside);
  const RestoredRun run = alone_as(2, restore_run(written(folder, entries)));
  CHECK(run.robot == 2);
  REQUIRE(run.closures.size() == 1);
  CHECK(run.closures[0].id() == ClosureId{{2, 1}, {2, 4}});
  CHECK(run.outcomes.empty());
  for (KeyframeIndex i = 0; i < 5; ++i) {
    CHECK(run.odometry[i].id == KeyframeId{2, i});
    CHECK(run.keyframes[i].odometry.id == KeyframeId{2, i});
  }
}

TEST_CASE("Contradicting journal entries are named") {
  const TemporaryFolder folder;
  std::mt19937 rng(8);
  const JournalStart start{kRobot, 1, "x"};
  const auto message = Contains("run.journal: entry 2");
  CHECK_THROWS_WITH(restore_run(written(folder, {start, step(1, rng)})), message);
  CHECK_THROWS_WITH(restore_run(written(folder, {start, features(3, rng)})), message);
  CHECK_THROWS_WITH(restore_run(written(folder, {start, JournalStart{kRobot + 1, 1, "x"}})),
                    message);
  CHECK_THROWS_WITH(restore_run(written(folder, {step(0, rng)})), Contains("run.journal: entry 1"));
  CHECK_THROWS_WITH(restore_run(written(folder, {start, state(5, rng), state(5, rng)})),
                    Contains("run.journal: entry 3"));
}

}  // namespace
}  // namespace km
