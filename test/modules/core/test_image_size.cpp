#include <catch2/catch.hpp>

#include <string>

#include "modules/core/image_size.hpp"

namespace km {
namespace {

TEST_CASE("PNG and JPEG files contain their size", "[core]") {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\2\xF0\0\0\1\xE0", 24);
  CHECK(stated_image_size(png) == ImageSize{752, 480});
  CHECK_FALSE(stated_image_size(png.substr(0, 23)));
  // A comment of two bytes, a fill byte, then the frame header of a progressive file.
  const std::string jpeg("\xFF\xD8\xFF\xFE\0\4ab\xFF\xFF\xC2\0\x11\x08\1\xE0\2\xF0\3", 19);
  CHECK(stated_image_size(jpeg) == ImageSize{752, 480});
  CHECK_FALSE(stated_image_size(jpeg.substr(0, 16)));
}

TEST_CASE("A file without a size in its header has no size", "[core]") {
  CHECK_FALSE(stated_image_size(""));
  CHECK_FALSE(stated_image_size("BM"));
  CHECK_FALSE(stated_image_size("\xFF\xD8"));
}

}  // namespace
}  // namespace km
