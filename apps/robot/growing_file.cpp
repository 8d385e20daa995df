#include "apps/robot/growing_file.hpp"

#include <stdexcept>

#include "modules/core/input_file.hpp"
#include "modules/core/write_file.hpp"

namespace km {

std::string GrowingFile::go_on() {
  std::string rows;
  results_.append(file_, [&rows](const auto& file) {
    if (is_there(file)) rows = read_input_file(file);
  });
  rows.resize(rows.rfind('\n') + 1);
  keep_bytes_ = rows.size();
  header_ = rows.substr(0, rows.find('\n') + 1);
  is_begun_ = !rows.empty();
  return rows;
}

void GrowingFile::flush() {
  const std::string rows = rows_.str();
  rows_.str({});
  if (header_.empty()) header_ = rows.substr(0, rows.find('\n') + 1);
  if (waiting_.size() + rows.size() <= kMaxWaiting_bytes)
    waiting_ += rows;
  else
    rows_lost_ = true;
  results_.append(file_, [this](const auto&) { append(); });
}

void GrowingFile::append() {
  if (keep_bytes_ && is_there(file_)) std::filesystem::resize_file(file_, *keep_bytes_);
  keep_bytes_.reset();
  if (is_begun_ && !is_there(file_) && is_there(file_.parent_path())) {
    waiting_.insert(0, header_);
    is_begun_ = false;
    rows_gone_ = true;
  }
  // The first part may end in the middle of a row; the next part is its continuation.
  if (!waiting_.empty()) append_to_file(file_, waiting_);
  is_begun_ = is_begun_ || !header_.empty();
  if (rows_gone_)
    throw std::runtime_error(file_.string() +
                             ": rows are missing, the file was deleted or moved during the run");
  if (rows_lost_)
    throw std::runtime_error(file_.string() + ": rows are missing, the disk was full for too long");
}

}  // namespace km
