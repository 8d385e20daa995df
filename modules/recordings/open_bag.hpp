#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// True if open_bag() accepts `path`: a file, or a folder with .db3 or .mcap files.
[[nodiscard]] bool may_be_bag(const std::filesystem::path& path);

/// Opens a recording, whose kind is recognised by its first bytes. All .db3 or .mcap files in a
/// folder of rosbag2 are read as one recording. Throws InputFileError for anything else.
[[nodiscard]] std::unique_ptr<BagReader> open_bag(const std::filesystem::path& path);

/// Reads bags of ROS 1, version 2.0 (wiki.ros.org/Bags/Format/2.0): chunks that are not compressed,
/// or by bz2 or lz4. A bag without an index, whose recorder was killed, is read once before the
/// first message and yields its complete chunks. Throws InputFileError if `path` is no file, does
/// not begin as such a bag, or is encrypted.
[[nodiscard]] std::unique_ptr<BagReader> open_ros1_bag(const std::filesystem::path& path);

/// Reads MCAP files (mcap.dev/spec), version 0: messages in chunks (not compressed, lz4, zstd) and
/// outside of them. If the summary at the end describes all channels and chunks, a chunk is read
/// when its first message is due. Otherwise the whole file is read once before the first message. A
/// file without an end, whose writer was killed, yields its complete parts. The reader verifies the
/// checksums of the summary, of chunks, and of a data section with messages outside of chunks, if
/// present. Attachments, metadata and records of other kinds are skipped. Throws InputFileError if
/// `path` is no file or does not begin as such a file.
[[nodiscard]] std::unique_ptr<BagReader> open_mcap(const std::filesystem::path& path);

/// Reads the .db3 files of rosbag2: SQLite databases with tables topics and messages. The reader
/// does not write to the file and runs no views and triggers of the database. It also reads
/// messages that the recorder left in a write-ahead log beside the file. Faults name the message by
/// its id in the table. Throws InputFileError if `path` is no file, no database, or lacks one of
/// the two tables.
[[nodiscard]] std::unique_ptr<BagReader> open_db3(const std::filesystem::path& path);

/// Several files of one recording as one stream. Messages of equal time are in the order of the
/// files.
[[nodiscard]] std::unique_ptr<BagReader> merge_bags(
    std::vector<std::unique_ptr<BagReader>> readers);

/// The attachments of an MCAP file by name; of several with one name, the last. A truncated file
/// yields its complete attachments. Throws InputFileError if the file is no MCAP file, or if an
/// attachment is damaged.
[[nodiscard]] std::map<std::string, std::string> read_mcap_attachments(
    const std::filesystem::path& path);

}  // namespace km
