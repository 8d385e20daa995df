#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "modules/simulation/dataset/image_encoding.hpp"
#include "modules/simulation/dataset/whole_file.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kText = "all or nothing";

std::string refusal(const fs::path& file) {
  try {
    write_whole_file(file, std::string_view(kText));
  } catch (const RecordingError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("A file is written whole, and its folders are made", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a/b/data.csv";
  write_whole_file(file, std::string_view(kText));
  CHECK(folder.read("a/b/data.csv") == kText);
  write_whole_file(file, std::string_view("again"));
  CHECK(folder.read("a/b/data.csv") == "again");
  CHECK(std::distance(fs::directory_iterator(file.parent_path()), {}) == 1);
}

TEST_CASE("A full disk is named with its file and leaves no file behind", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "image.jpg";
  fs::create_symlink("/dev/full", file.string() + ".part");  // every write fails with ENOSPC
  const std::string message = refusal(file);
  CAPTURE(message);
  CHECK_THAT(message, Catch::Contains(file.string()) && Catch::Contains("No space left") &&
                          Catch::Contains("same command"));
  CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("A full disk leaves the file that was there", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("table.csv", "old");
  fs::create_symlink("/dev/full", file.string() + ".part");
  CHECK_FALSE(refusal(file).empty());
  CHECK(folder.read("table.csv") == "old");
}

TEST_CASE("A place that cannot be written is named", "[simulation][dataset]") {
  const TemporaryFolder folder;
  const fs::path file = folder.write("file", "") / "below/data.csv";
  CHECK_THAT(refusal(file), Catch::Contains(folder.path().string() + "/file"));
}

TEST_CASE("A truncated image is not whole", "[simulation][dataset]") {
  const auto format = GENERATE(ImageFormat::kJpeg, ImageFormat::kPng);
  const TemporaryFolder folder;
  const fs::path file = folder.path() / ("image" + extension(format));
  GrayImage image{16, 16, std::vector<std::uint8_t>(256, 77)};
  auto bytes = encode_gray(image, format);
  CHECK_FALSE(is_whole_image(file));
  write_whole_file(file, bytes);
  CHECK(is_whole_image(file));
  bytes.pop_back();
  write_whole_file(file, bytes);
  CHECK_FALSE(is_whole_image(file));
  write_whole_file(file, std::string_view());
  CHECK_FALSE(is_whole_image(file));
}

}  // namespace km
