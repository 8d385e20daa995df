#include "modules/charts/page_file.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace km {

std::string_view page_file(std::span<const PageFile> files, std::string_view path) {
  const auto found = std::ranges::find(files, path, &PageFile::path);
  if (found == files.end()) throw std::logic_error("no page file " + std::string(path));
  return found->bytes;
}

}  // namespace km
