#include "apps/lab/simulate/dataset_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "apps/lab/simulation/dataset/recording_files.hpp"
#include "apps/output_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecordFile = "simulation.json";

// JSON is YAML.
DatasetRecord read_record(const fs::path& file) try {
  const YAML::Node root = YAML::LoadFile(file.string());
  DatasetRecord record;
  record.generator = root["generator"].as<std::string>();
  for (const auto& entry : root["parameters"])
    record.parameters.emplace_back(entry.first.as<std::string>(), entry.second.as<std::string>());
  record.finished_robots = root["finished_robots"].as<std::vector<std::string>>();
  record.complete = root["complete"].as<bool>();
  return record;
} catch (const YAML::Exception& error) {
  throw std::runtime_error(file.string() + ": cannot be understood (" + error.what() +
                           "); choose another --output, or remove the folder");
}

}  // namespace

DatasetFolder::DatasetFolder(const fs::path& path, const DatasetRecord& wanted) : path_(path) {
  make_output_folder(path_);
  lock();
  try {
    open_record(wanted);
  } catch (...) {
    close(lock_);
    throw;
  }
}

DatasetFolder::~DatasetFolder() {
  close(lock_);
}

void DatasetFolder::lock() {
  lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0)
    throw std::runtime_error(path_.string() + ": cannot be read: " + std::strerror(errno));
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
    return;  // some disks do not support locks
  close(lock_);
  throw std::runtime_error(path_.string() + ": another run is writing to it");
}

void DatasetFolder::open_record(const DatasetRecord& wanted) {
  const fs::path file = path_ / kRecordFile;
  if (!fs::exists(file)) {
    if (!fs::is_empty(path_))
      throw std::runtime_error(path_.string() + " is not empty and not made by this program (no " +
                               kRecordFile + " in it); choose another --output");
    record_ = wanted;
    return write_record();
  }
  record_ = read_record(file);
  resumed_ = true;
  const auto found = differences(record_, wanted);
  if (found.empty()) return;
  std::string message = path_.string() + " was made with other parameters:";
  for (const std::string& line : found) message += "\n  " + line;
  throw std::runtime_error(message +
                           "\nGive the same ones to continue there, choose another --output, or "
                           "remove the folder.");
}

void DatasetFolder::mark_finished(const std::string& robot) {
  std::vector<std::string>& robots = record_.finished_robots;
  if (std::find(robots.begin(), robots.end(), robot) == robots.end()) robots.push_back(robot);
  std::sort(robots.begin(),
            robots.end());  // fixes the order, which otherwise depends on the threads
  write_record();
}

void DatasetFolder::mark_complete() {
  record_.complete = true;
  write_record();
}

void DatasetFolder::mark_incomplete() {
  record_.complete = false;
  record_.finished_robots.clear();
  write_record();
}

std::uintmax_t DatasetFolder::free_space() const {
  return fs::space(path_).available;
}

void DatasetFolder::write_record() const {
  write_whole_file(path_ / kRecordFile, to_json(record_));
}

}  // namespace km
