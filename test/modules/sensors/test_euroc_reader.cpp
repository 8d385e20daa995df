#include "modules/sensors/euroc_reader.hpp"

#include <catch2/catch.hpp>

#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

std::vector<SensorPacket> read_all(EurocReader& reader) {
  std::vector<SensorPacket> packets;
  while (auto packet = reader.next()) packets.push_back(std::move(*packet));
  return packets;
}

// The contract of SensorPacket: samples in order, each packet starts with the last sample of the
// one before, and ends with the first sample at or after its frame.
void check_imu_contract(const std::vector<SensorPacket>& packets) {
  for (std::size_t i = 0; i < packets.size(); ++i) {
    CAPTURE(i);
    const auto& imu = packets[i].imu;
    const Stamp stamp = packets[i].frame->stamp;
    REQUIRE_FALSE(imu.empty());
    for (std::size_t k = 1; k < imu.size(); ++k) REQUIRE(imu[k - 1].stamp < imu[k].stamp);
    CHECK(imu.back().stamp >= stamp);
    if (imu.size() > 1) CHECK(imu[imu.size() - 2].stamp < stamp);
    if (i > 0) CHECK(imu.front().stamp == packets[i - 1].imu.back().stamp);
  }
}

}  // namespace

TEST_CASE("A faultless recording gives every pair and every sample between", "[sensors]") {
  const EurocFolder folder(GENERATE(".png", ".jpg"));
  EurocReader reader(folder.root());
  const auto packets = read_all(reader);
  REQUIRE(packets.size() == EurocFolder::kPairs);
  CHECK(reader.pair_count() == EurocFolder::kPairs);
  CHECK(reader.report().empty());
  check_imu_contract(packets);
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    const StereoFrame& frame = *packets[static_cast<std::size_t>(i)].frame;
    CHECK(frame.stamp == EurocFolder::image_stamp(i));
    CHECK(frame.left.width == 32);
    CHECK(frame.right.height == 24);
    REQUIRE(frame.left.pixels.size() == 32 * 24);
    CHECK(frame.left.pixels.front() == 10 * (i + 1));
    CHECK(frame.right.pixels.back() == 10 * (i + 1));
  }
  // 50 ms at 200 Hz: ten intervals, eleven samples.
  CHECK(packets[1].imu.size() == 11);
  CHECK(packets[1].imu[0].gyro == Eigen::Vector3d(0.1, 0.2, 0.3));
  CHECK(packets[1].imu[0].accel == Eigen::Vector3d(1.0, 2.0, 9.8));
}

TEST_CASE("The folder mav0 itself will do", "[sensors]") {
  const EurocFolder folder;
  CHECK(EurocReader(folder.mav0()).pair_count() == EurocFolder::kPairs);
}

TEST_CASE("The first packet leads in by one second, also from before the window", "[sensors]") {
  const EurocFolder folder;
  EurocReader reader(folder.root(), {.from_s = 0.1});
  const auto packet = reader.next();
  REQUIRE(packet);
  CHECK(packet->frame->stamp == EurocFolder::image_stamp(2));
  CHECK(packet->imu.front().stamp == packet->frame->stamp - 1'000'000'000);
  CHECK(packet->imu.size() == 201);
}

TEST_CASE("A window is half open and counts from the recording's first image", "[sensors]") {
  const EurocFolder folder;
  EurocReader first(folder.root(), {.from_s = 0.0, .to_s = 0.2});
  EurocReader second(folder.root(), {.from_s = 0.2, .to_s = 100.0});
  const auto a = read_all(first);
  const auto b = read_all(second);
  REQUIRE(a.size() == 4);
  REQUIRE(b.size() == 4);
  CHECK(a.back().frame->stamp == EurocFolder::image_stamp(3));
  CHECK(b.front().frame->stamp == EurocFolder::image_stamp(4));
  CHECK(second.recording_start() == EurocFolder::kFirstImage);
  CHECK(second.first_stamp() == EurocFolder::image_stamp(4));
  CHECK(second.last_stamp() == EurocFolder::image_stamp(7));
  CHECK_THROWS_AS(EurocReader(folder.root(), {.from_s = 1.0, .to_s = 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(EurocReader(folder.root(), {.from_s = std::nan("")}), std::invalid_argument);
  CHECK_THROWS_WITH(EurocReader(folder.root(), {.from_s = 1.0}),
                    Catch::Contains("from 0 s to 0.35 s"));
}

TEST_CASE("Blanks, comments, CRLF and a bare header in the lists are accepted", "[sensors]") {
  const EurocFolder folder;
  std::string list = "timestamp [ns] , filename\r\n";
  for (int i = 0; i < EurocFolder::kPairs; ++i) {
    const std::string stamp = std::to_string(EurocFolder::image_stamp(i));
    list += "  " + stamp + " ,  " + stamp + ".png  # note\r\n\r\n";
  }
  folder.write("cam0/data.csv", list);
  EurocReader reader(folder.root());
  CHECK(read_all(reader).size() == EurocFolder::kPairs);
  CHECK(reader.report().empty());
}

TEST_CASE("Stamps of left and right may differ by the tolerance", "[sensors]") {
  const EurocFolder folder;
  folder.replace("cam1/data.csv", "10100000000,", "10100000400,");
  CHECK(EurocReader(folder.root(), {.stereo_tolerance_s = 1e-6}).pair_count() == 8);
  EurocReader strict(folder.root(), {.stereo_tolerance_s = 1e-7});
  CHECK(strict.pair_count() == 7);
  CHECK(strict.report().count(ReaderFault::kLeftWithoutRight) == 1);
  CHECK(strict.report().count(ReaderFault::kRightWithoutLeft) == 1);
}

TEST_CASE("MH_01_easy: 320 pairs in 16 s, one step of 100 ms, covered by samples", "[sensors]") {
  const auto folder = shared_data("euroc/MH_01_easy");
  if (!folder) return;
  EurocReader reader(*folder, {.from_s = 0.0, .to_s = 16.01});
  const auto packets = read_all(reader);
  REQUIRE(packets.size() == 320);
  CHECK(reader.report().empty());
  check_imu_contract(packets);
  int long_steps = 0;
  for (std::size_t i = 1; i < packets.size(); ++i) {
    const double step_s = seconds_between(packets[i - 1].frame->stamp, packets[i].frame->stamp);
    if (step_s > 0.06) {
      ++long_steps;
      CHECK(step_s == Approx(0.1).margin(1e-6));
      CHECK(packets[i].imu.size() == 21);
    }
  }
  CHECK(long_steps == 1);
  CHECK(packets.front().imu.size() == 201);
  CHECK(packets.front().frame->left.width == 752);
  CHECK(reader.rig().stereo.baseline_m() == Approx(0.110).margin(0.001));  // README of the data
}

}  // namespace km
