#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <functional>

#include "modules/core/imu_limits.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/image_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay_ns = 86'400'000'000'000;

// Bytes of a PNG file whose header says `width` x `height`, with too few bytes after it.
std::string png_of(std::uint32_t width, std::uint32_t height) {
  const std::vector<std::uint8_t> encoded = encode_png(cv::Mat(24, 32, CV_8UC1, cv::Scalar(7)));
  std::string bytes(encoded.begin(), encoded.end());
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[16 + i] = static_cast<char>(width >> (24 - 8 * i));
    bytes[20 + i] = static_cast<char>(height >> (24 - 8 * i));
  }
  return bytes;
}

// Invariants of a reader for any files.
void check_recording(FolderReader& reader) {
  check_rig(reader.rig());
  Stamp last = 0;
  for (const SensorPacket& packet : packets_of(reader)) {
    CHECK(packet.frame->stamp > last);
    last = packet.frame->stamp;
    CHECK(packet.frame->left.pixels.size() == 32 * 24);
    for (std::size_t i = 0; i < packet.imu.size(); ++i) {
      CHECK(is_plausible(packet.imu[i]));
      if (i > 0) CHECK(packet.imu[i - 1].stamp < packet.imu[i].stamp);
    }
  }
  const ReaderReport report = reader.report();
  for (const auto& [fault, entry] : report.entries()) {
    CAPTURE(to_string(fault), entry.first);
    CHECK(entry.first.find("/mav0/") != entry.first.npos);
    CHECK(entry.first.size() < 1000);
  }
}

struct Row {
  const char* what;
  const char* file;
  int line;            // line of the list
  std::string values;  // for the row; "+N" and "-N" move its stamp
  ReaderFault fault;
  std::size_t packets;
};

// Corrupts one row of a list.
void corrupt_row(const EurocFolder& folder, const Row& row) {
  const std::string text = folder.read(row.file);
  std::size_t begin = 0;
  for (int line = 1; line < row.line; ++line) begin = text.find('\n', begin) + 1;
  const std::size_t end = text.find('\n', begin);
  std::string line = text.substr(begin, end - begin);
  const std::size_t comma = line.find(',');
  if (row.values.starts_with('+') || row.values.starts_with('-'))
    line = std::to_string(std::stoll(line.substr(0, comma)) + std::stoll(row.values)) +
           line.substr(comma);
  else
    line.replace(comma + 1, line.npos, row.values);
  folder.write(row.file, text.substr(0, begin) + line + text.substr(end));
}

}  // namespace

TEST_CASE("A bad row is skipped and counted with its line and no other row is", "[sensors]") {
  const std::string day = std::to_string(kDay_ns);
  const Row row = GENERATE_COPY(
      Row{"gyro 1e300", "imu0/data.csv", 300, "1e300,0,0,0,0,9.8", ReaderFault::kImplausible, 8},
      Row{"gyro 150", "imu0/data.csv", 300, "0,0,150,0,0,9.8", ReaderFault::kImplausible, 8},
      Row{"accel -1e300", "imu0/data.csv", 300, "0,0,0,-1e300,0,9.8", ReaderFault::kImplausible, 8},
      Row{"NaN", "imu0/data.csv", 300, "nan,0,0,0,0,9.8", ReaderFault::kNotFinite, 8},
      Row{"text", "imu0/data.csv", 300, "zero,0,0,0,0,9.8", ReaderFault::kMalformedRow, 8},
      Row{"too few fields", "imu0/data.csv", 300, "0,0,0,0", ReaderFault::kMalformedRow, 8},
      Row{"infinite", "imu0/data.csv", 300, "0,0,0,inf,0,9.8", ReaderFault::kNotFinite, 8},
      Row{"beyond a double", "imu0/data.csv", 300, "0,0,0,1e400,0,9", ReaderFault::kMalformedRow,
          8},
      Row{"imu a day ahead", "imu0/data.csv", 300, '+' + day, ReaderFault::kUnorderedStamp, 8},
      Row{"imu at once", "imu0/data.csv", 2, '+' + day, ReaderFault::kUnorderedStamp, 8},
      Row{"imu at last", "imu0/data.csv", 502, '+' + day, ReaderFault::kJumpingStamp, 8},
      Row{"imu a second behind", "imu0/data.csv", 300, "-1000000001", ReaderFault::kUnorderedStamp,
          8},
      Row{"image at last", "cam0/data.csv", 9, '+' + day, ReaderFault::kJumpingStamp, 7},
      Row{"image a day ahead", "cam0/data.csv", 4, '+' + day, ReaderFault::kUnorderedStamp, 7},
      Row{"image at once", "cam0/data.csv", 2, '+' + day, ReaderFault::kUnorderedStamp, 7},
      Row{"image behind", "cam0/data.csv", 5, "-149999999", ReaderFault::kUnorderedStamp, 7},
      Row{"folder for an image", "cam0/data.csv", 4, ".", ReaderFault::kMissingImage, 7},
      Row{"a name too long", "cam0/data.csv", 4, std::string(5000, 'n'), ReaderFault::kMissingImage,
          7});
  CAPTURE(row.what);
  const EurocFolder folder;
  corrupt_row(folder, row);
  FolderReader reader = open_folder(folder.root());
  CHECK(packets_of(reader).size() == row.packets);
  REQUIRE(reader.report().count(row.fault) == 1);
  const ReaderReport report = reader.report();
  CHECK_THAT(report.entries().at(row.fault).first,
             Catch::Contains(std::string(row.file) + " line " + std::to_string(row.line)));
  CHECK(reader.report().count(ReaderFault::kImuGap) == 0);
}

struct BadImage {
  const char* what;
  ReaderFault fault;
  const char* problem;
  std::function<void(const fs::path&)> corrupt;
};

// Replaces a file.
auto by_bytes(std::string bytes) {
  return [bytes = std::move(bytes)](const fs::path& file) {
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << bytes;
  };
}

TEST_CASE("A bad image loses its pair and no inertial sample", "[sensors]") {
  using enum ReaderFault;
  const BadImage bad = GENERATE(
      BadImage{"missing", kMissingImage, ".png: no such image", [](auto& f) { fs::remove(f); }},
      BadImage{"a symbolic link to itself", kMissingImage,
               "no such image: Too many levels of symbolic links",
               [](const fs::path& file) {
                 fs::remove(file);
                 fs::create_symlink(file.filename(), file);
               }},
      BadImage{"truncated", kUnreadableImage, "truncated image",
               [](auto& file) { fs::resize_file(file, fs::file_size(file) - 14); }},
      BadImage{"larger than memory", kUnreadableImage, "larger than 256 MiB",
               [](auto& file) { fs::resize_file(file, std::uintmax_t{1} << 40U); }},
      BadImage{"empty", kUnreadableImage, "empty", by_bytes("")},
      BadImage{"text", kUnreadableImage, "neither a PNG nor a JPEG file", by_bytes("hello")},
      BadImage{"another size", kWrongImageSize, "24x32 px, the calibration states 32x24",
               [](auto& file) { write_png(file, cv::Mat(32, 24, CV_8UC1)); }},
      BadImage{"65535 x 65535", kWrongImageSize, "65535x65535 px, the calibration states 32x24",
               by_bytes(png_of(65535, 65535))},
      BadImage{"4294967295 x 1", kWrongImageSize, "px, the calibration states",
               by_bytes(png_of(0xffffffffU, 1))},
      BadImage{"0 x 0", kWrongImageSize, "0x0 px, the calibration states", by_bytes(png_of(0, 0))});
  CAPTURE(bad.what);
  const EurocFolder folder;
  bad.corrupt(folder.image("cam1", 3));
  const Outcome outcome = read(folder);
  REQUIRE(outcome.packets.size() == EurocFolder::kPairs - 1);
  CHECK(outcome.report.entries().size() == 1);
  REQUIRE(outcome.report.count(bad.fault) == 1);
  CHECK_THAT(outcome.report.entries().at(bad.fault).first,
             Catch::Contains("cam0/data.csv line 5: ") && Catch::Contains(bad.problem));
  CHECK(outcome.packets[3].imu.size() == 21);  // 100 ms
  CHECK(outcome.packets[3].imu.front().stamp == outcome.packets[2].imu.back().stamp);
}

TEST_CASE("A corrupted list or calibration is refused or gives valid packets", "[sensors]") {
  const std::string file =
      GENERATE("imu0/data.csv", "cam0/data.csv", "cam1/data.csv", "imu0/sensor.yaml",
               "cam0/sensor.yaml", "cam1/sensor.yaml", "depth0/sensor.yaml");
  CAPTURE(file);
  const EurocFolder folder;
  if (file.starts_with("depth0")) folder.make_rgbd();
  const std::string good = folder.read(file);
  check_corrupted<DatasetError>(good, folder.root().string(), [&](const std::string& text) {
    folder.write(file, text);
    FolderReader reader = open_folder(folder.root());
    check_recording(reader);
  });
}

TEST_CASE("A corrupted image gives an image of the right size or none", "[sensors]") {
  const bool is_jpeg = GENERATE(false, true);
  CAPTURE(is_jpeg);
  cv::Mat pixels(24, 32, CV_8UC1);
  cv::randu(pixels, 0, 255);
  const std::vector<std::uint8_t> encoded = is_jpeg ? encode_jpeg(pixels, 95) : encode_png(pixels);
  const TemporaryFolder folder;
  check_corrupted<DatasetError>(
      {encoded.begin(), encoded.end()}, "", [&](const std::string& bytes) {
        const ImageResult loaded = load_gray_image(folder.write("image", bytes), 32, 24);
        const bool ok = loaded.status == ImageStatus::kOk;
        CHECK(loaded.image.pixels.size() == (ok ? 32 * 24 : 0));
        CHECK(loaded.problem.empty() == ok);
      });
}

TEST_CASE("A file of a recording that is not a file is refused by name", "[sensors]") {
  const std::string file = GENERATE("imu0/data.csv", "cam0/data.csv", "imu0/sensor.yaml");
  const EurocFolder folder;
  const fs::path place = folder.mav0() / file;
  fs::remove(place);
  const bool loop = GENERATE(true, false);
  loop ? fs::create_symlink(place.filename(), place)
       : static_cast<void>(fs::create_directory(place));
  CHECK_THROWS_WITH(
      open_folder(folder.root()),
      place.string() + (loop ? ": Too many levels of symbolic links" : ": a folder, not a file"));
}

}  // namespace km
