#include <catch2/catch.hpp>

#include "apps/experiments/recorded_flight_files.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

TEST_CASE("An original recording is found by the images it has", "[experiments]") {
  const TemporaryFolder folder;
  folder.write("vicon_room1/V1_01_easy/mav0/cam0/data/1000000000.png", "");
  folder.write("vicon_room1/V1_01_easy/mav0/state_groundtruth_estimate0/data.csv", "");
  folder.write("vicon_room1/V1_01_easy/mav0/imu0/data.csv", "");
  folder.write("vicon_room1/V1_02_medium/mav0/cam0/data/1000000000.png", "");
  const RecordedFlightFiles excerpt = find_recorded_flight(folder.path(), "V1_01");
  CHECK(excerpt.folder.empty());
  CHECK(excerpt.truth ==
        folder.path() / "vicon_room1/V1_01_easy/mav0/state_groundtruth_estimate0/data.csv");
  CHECK(excerpt.imu == folder.path() / "vicon_room1/V1_01_easy/mav0/imu0/data.csv");
  folder.write("vicon_room1/V1_01_easy/mav0/cam0/data/61000000000.png", "");
  CHECK(find_recorded_flight(folder.path(), "V1_01").folder ==
        folder.path() / "vicon_room1/V1_01_easy");
}

TEST_CASE("True poses and inertial data are found without images", "[experiments]") {
  const TemporaryFolder folder;
  const auto truth = folder.write("truth/V2_03_difficult.csv.gz", "");
  const auto imu = folder.write("imu/V2_03_difficult.imu.csv.gz", "");
  folder.write("truth/V2_03_difficult.pdf", "");
  const RecordedFlightFiles files = find_recorded_flight(folder.path(), "V2_03");
  CHECK(files.truth == truth);
  CHECK(files.imu == imu);
  CHECK(files.folder.empty());
  CHECK(find_recorded_flight(folder.path(), "V2_02").truth.empty());
  CHECK(find_recorded_flight({}, "V2_03").truth.empty());
  CHECK(find_recorded_flight(folder.path() / "none", "V2_03").truth.empty());
}

}  // namespace
}  // namespace km
