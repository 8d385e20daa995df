#include <catch2/catch.hpp>

#include "modules/sensors/euroc_reader.hpp"
#include "test/modules/sensors/euroc_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  std::vector<SensorPacket> packets;
  ReaderReport report;
};

Outcome read(const EurocFolder& folder) {
  EurocReader reader(folder.root());
  Outcome outcome;
  while (auto packet = reader.next()) outcome.packets.push_back(std::move(*packet));
  outcome.report = reader.report();
  return outcome;
}

std::string first_of(const ReaderReport& report, ReaderFault fault) {
  REQUIRE(report.count(fault) > 0);
  return report.entries().at(fault).first;
}

// Seven pairs are left and the report holds this one fault, of which the example says `text`.
void check_one_pair_less(const EurocFolder& folder, ReaderFault fault, const std::string& text) {
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == EurocFolder::kPairs - 1);
  CHECK(outcome.report.entries().size() == 1);
  CHECK(outcome.report.count(fault) == 1);
  CHECK_THAT(first_of(outcome.report, fault), Catch::Contains(text));
}

}  // namespace

TEST_CASE("Missing files and folders are refused by name", "[sensors]") {
  const EurocFolder folder;
  CHECK_THROWS_WITH(EurocReader("/nowhere/at/all"), "/nowhere/at/all: no such folder");
  for (const std::string file : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv",
                                 "cam0/sensor.yaml", "cam1/sensor.yaml", "imu0/sensor.yaml"}) {
    CAPTURE(file);
    const EurocFolder spoilt;
    fs::remove(spoilt.mav0() / file);
    CHECK_THROWS_WITH(EurocReader(spoilt.root()),
                      (spoilt.mav0() / file).string() + ": no such file");
  }
  fs::remove_all(folder.mav0() / "cam1");
  CHECK_THROWS_WITH(EurocReader(folder.root()), Catch::Contains("cam1/sensor.yaml: no such file") &&
                                                    Catch::Contains("nor depth0"));
  fs::remove_all(folder.mav0());
  CHECK_THROWS_WITH(EurocReader(folder.root()), Catch::Contains("not a EuRoC recording"));
}

TEST_CASE("Lists without a usable row are refused", "[sensors]") {
  const EurocFolder folder;
  SECTION("images") {
    folder.write("cam0/data.csv", "#timestamp [ns],filename\n");
    CHECK_THROWS_WITH(EurocReader(folder.root()), Catch::EndsWith("data.csv: lists no image"));
  }
  SECTION("inertial samples") {
    folder.write("imu0/data.csv", "nonsense\n1,2,3\n");
    CHECK_THROWS_WITH(EurocReader(folder.root()), Catch::EndsWith("holds no inertial sample"));
  }
  SECTION("no pairs") {
    folder.write("cam1/data.csv", "55,55.png\n");
    CHECK_THROWS_WITH(EurocReader(folder.root()), Catch::Contains("no image of cam0"));
  }
}

TEST_CASE("A bad image costs its pair and no inertial sample", "[sensors]") {
  const EurocFolder folder;
  const fs::path image = folder.image("cam1", 3);
  ReaderFault fault = ReaderFault::kMissingImage;
  std::string text = "cam0/data.csv line 5: ";
  SECTION("missing") {
    fs::remove(image);
    text += image.string() + ": no such image";
  }
  SECTION("truncated PNG") {
    fault = ReaderFault::kUnreadableImage;
    fs::resize_file(image, fs::file_size(image) - 14);
    text = "truncated image";
  }
  SECTION("empty") {
    fault = ReaderFault::kUnreadableImage;
    fs::resize_file(image, 0);
    text = "empty";
  }
  SECTION("not an image") {
    fault = ReaderFault::kUnreadableImage;
    folder.write(fs::relative(image, folder.mav0()).string(), "hello");
    text = "not an image that can be decoded";
  }
  SECTION("wrong size") {
    fault = ReaderFault::kWrongImageSize;
    folder.write_image(fs::relative(image, folder.mav0()).string(), 24, 32, 7);
    text = "24x32 px, the calibration says 32x24";
  }
  check_one_pair_less(folder, fault, text);
  const auto packets = read(folder).packets;
  CHECK(packets[3].imu.size() == 21);  // 100 ms
  CHECK(packets[3].imu.front().stamp == packets[2].imu.back().stamp);
}

TEST_CASE("A truncated JPEG is not taken for an image", "[sensors]") {
  const EurocFolder folder(".jpg");
  fs::path image = folder.image("cam0", 0);
  image.replace_extension(".jpg");
  fs::resize_file(image, fs::file_size(image) * 2 / 3);
  check_one_pair_less(folder, ReaderFault::kUnreadableImage, "truncated image");
}

TEST_CASE("Faulty rows of an image list are skipped and counted with their line", "[sensors]") {
  const EurocFolder folder;
  const std::string row = "10150000000,10150000000.png\n";  // line 5
  SECTION("repeated") {
    for (const std::string camera : {"cam0/data.csv", "cam1/data.csv"})
      folder.replace(camera, row, row + row);
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 8);
    CHECK(outcome.report.count(ReaderFault::kRepeatedStamp) == 2);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kRepeatedStamp),
               Catch::EndsWith("cam0/data.csv line 6: 10150000000"));
  }
  SECTION("out of order") {
    folder.replace("cam0/data.csv", row, row + "10000000001,x.png\n");
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 8);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kUnorderedStamp),
               Catch::EndsWith("line 6: 10000000001 comes after 10150000000"));
  }
  SECTION("not a stamp") {
    folder.replace("cam0/data.csv", "10150000000,", "abc,");
    const Outcome outcome = read(folder);
    CHECK(outcome.packets.size() == 7);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kMalformedRow),
               Catch::EndsWith("line 5: abc is not a stamp in nanoseconds"));
    CHECK(outcome.report.count(ReaderFault::kRightWithoutLeft) == 1);
  }
  SECTION("no name") {
    folder.replace("cam0/data.csv", row, "10150000000\n");
    const Outcome outcome = read(folder);
    CHECK_THAT(first_of(outcome.report, ReaderFault::kMalformedRow),
               Catch::EndsWith("line 5: 1 fields, expected 2"));
  }
  SECTION("left without right") {
    folder.replace("cam1/data.csv", row, "");
    check_one_pair_less(folder, ReaderFault::kLeftWithoutRight,
                        "cam0/data.csv line 5: 10150000000.png");
  }
}

TEST_CASE("Faulty inertial samples are left out and counted", "[sensors]") {
  const EurocFolder folder;
  const std::string at = "10100000000,0.1";  // line 322
  ReaderFault fault = ReaderFault::kNotFinite;
  SECTION("NaN") {
    folder.replace("imu0/data.csv", at, "10100000000,nan");
  }
  SECTION("infinity") {
    folder.replace("imu0/data.csv", at, "10100000000,inf");
  }
  SECTION("text") {
    fault = ReaderFault::kMalformedRow;
    folder.replace("imu0/data.csv", at, "10100000000,zero");
  }
  SECTION("too few fields") {
    fault = ReaderFault::kMalformedRow;
    folder.replace("imu0/data.csv", at + ",0.2,0.3", at);
  }
  const Outcome outcome = read(folder);
  REQUIRE(outcome.packets.size() == 8);
  CHECK(outcome.report.entries().size() == 1);
  CHECK(outcome.report.count(fault) == 1);
  CHECK_THAT(first_of(outcome.report, fault), Catch::Contains("imu0/data.csv line 322"));
  // The sample at the third image is gone: the next one covers the interval.
  CHECK(outcome.packets[2].imu.back().stamp == 10'105'000'000);
}

TEST_CASE("A gap between inertial samples is reported, the pairs are kept", "[sensors]") {
  const EurocFolder folder;
  std::string text = folder.read("imu0/data.csv");
  const auto begin = text.find("10110000000");
  text.erase(begin, text.find("10145000000") - begin);
  folder.write("imu0/data.csv", text);
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 8);
  CHECK(outcome.report.count(ReaderFault::kImuGap) == 1);
  CHECK_THAT(first_of(outcome.report, ReaderFault::kImuGap),
             Catch::Contains("0.040000 s after 10105000000"));
}

TEST_CASE("Pairs outside the inertial samples are skipped", "[sensors]") {
  const EurocFolder folder;
  std::string text = folder.read("imu0/data.csv");
  SECTION("start late") {
    const auto begin = text.find("8500000000");
    text.erase(begin, text.find("10055000000") - begin);
  }
  SECTION("end early") {
    text.erase(text.find("10300000000"));
  }
  folder.write("imu0/data.csv", text);
  const Outcome outcome = read(folder);
  CHECK(outcome.packets.size() == 6);
  CHECK(outcome.report.count(ReaderFault::kPairWithoutImu) == 2);
}

TEST_CASE("The report reads as one line per kind of fault", "[sensors]") {
  ReaderReport report;
  CHECK(to_string(report).empty());
  report.add(ReaderFault::kMissingImage, "a.csv line 7: x.png");
  report.add(ReaderFault::kMissingImage, "a.csv line 9: y.png");
  CHECK(to_string(report) == "2 missing images, first: a.csv line 7: x.png\n");
}

}  // namespace km
