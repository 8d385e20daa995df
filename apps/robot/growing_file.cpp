#include "apps/robot/growing_file.hpp"

#include <stdexcept>

#include "modules/core/input_file.hpp"
#include "modules/core/write_file.hpp"

namespace km {

std::string GrowingFile::go_on() {
  std::string rows;
  results_.write(file_, [&rows](const auto& file) {
    if (is_there(file)) rows = read_input_file(file);
  });
  rows.resize(rows.rfind('\n') + 1);
  keep_bytes_ = rows.size();
  return rows;
}

void GrowingFile::flush() {
  const std::string rows = rows_.str();
  rows_.str({});
  if (waiting_.size() + rows.size() <= kMaxWaiting_bytes)
    waiting_ += rows;
  else
    rows_lost_ = true;
  results_.write(file_, [this](const auto&) { append(); });
}

void GrowingFile::append() {
  if (keep_bytes_ && is_there(file_)) std::filesystem::resize_file(file_, *keep_bytes_);
  keep_bytes_.reset();
  // The first part may end in the middle of a row; the next part is its continuation.
  if (!waiting_.empty()) append_to_file(file_, waiting_);
  if (rows_lost_)
    throw std::runtime_error(file_.string() + ": rows are missing, the disk was full for too long");
}

}  // namespace km
