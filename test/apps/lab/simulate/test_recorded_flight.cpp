#include <zlib.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <string>

#include "apps/lab/simulate/robot_scenario.hpp"
#include "modules/core/lie.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

const std::string kEuroc =
    "#timestamp,px,...\n"
    "1000,1,2,3,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n"
    "1000,1,2,3,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n"  // as published: a stamp twice
    "2000,1,2,4,0.5,0.5,-0.5,0.5,4,5,6,7,8,9,10,11,12\n";
const std::string kImu = "#t,gyro,accel\n900,1,2,3,4,5,6\n1900,1,2,3,4,5,7\n";

fs::path write_gzip(const TemporaryFolder& folder, const std::string& name,
                    const std::string& text) {
  const fs::path path = folder.path() / name;
  const gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  return path;
}

std::string refusal_of_flight(const std::string& truth, const std::string& imu) {
  const TemporaryFolder folder;
  const auto t = folder.write("truth.csv", truth);
  const auto i = folder.write("imu.csv", imu);
  try {
    (void)read_recorded_flight(t, i);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Recorded states and samples are read, gzipped or not", "[simulate]") {
  const TemporaryFolder folder;
  const bool zipped = GENERATE(false, true);
  const auto truth =
      zipped ? write_gzip(folder, "t.csv.gz", kEuroc) : folder.write("t.csv", kEuroc);
  const auto imu = zipped ? write_gzip(folder, "i.csv.gz", kImu) : folder.write("i.csv", kImu);
  const RecordedFlight flight = read_recorded_flight(truth, imu);
  REQUIRE(flight.truth.size() == 2);
  const TrueState& state = flight.truth[1];
  CHECK(state.stamp == 2000);
  CHECK(state.T_world_body.translation() == Eigen::Vector3d(1, 2, 4));
  const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
  CHECK((state.T_world_body.linear() - q.toRotationMatrix()).norm() < 1e-15);
  CHECK(state.velocity_world == Eigen::Vector3d(4, 5, 6));
  CHECK(state.accel_bias == Eigen::Vector3d(10, 11, 12));
  REQUIRE(flight.imu.size() == 2);
  CHECK(flight.imu[1].accel == Eigen::Vector3d(4, 5, 7));
  CHECK_THAT(flight.fingerprint, Catch::Contains(truth.filename().string()));
}

TEST_CASE("Recordings that cannot be used are refused by file and line", "[simulate]") {
  CHECK_THAT(refusal_of_flight(kEuroc + "3000,1,2,x,1,0,0,0\n", kImu),
             Catch::Contains("truth.csv line 5: 'x' is not a number"));
  CHECK_THAT(refusal_of_flight(kEuroc + "3000,1,2,3,9,0,0,0\n", kImu),
             Catch::Contains("line 5") && Catch::Contains("norm"));
  CHECK_THAT(refusal_of_flight(kEuroc + "1500,1,2,3,1,0,0,0\n", kImu), Catch::Contains("line 5"));
  CHECK_THAT(refusal_of_flight(kEuroc, kImu + "2900,1,2\n"),
             Catch::Contains("imu.csv line 4: has only 3 fields"));
  CHECK_THAT(refusal_of_flight("", kImu), Catch::Contains("truth.csv: holds no data"));
  CHECK_THAT(refusal_of_flight(kEuroc, "9000,1,2,3,4,5,6\n9900,1,2,3,4,5,7\n"),
             Catch::Contains("do not overlap in time"));
}

}  // namespace km
