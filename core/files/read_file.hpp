// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

/// The one way in which the programs read a file.
namespace backwash::files {

/// Sizes up to which files are read, bytes.
inline constexpr std::size_t kLargestConfiguration = 1u << 20;
inline constexpr std::size_t kLargestTable = std::size_t{2} << 30;  ///< CSV and flight recordings
inline constexpr std::size_t kLargestLog = std::size_t{8} << 30;    ///< raw logs

struct FileError {
  enum class Kind { not_found, not_regular, too_large } kind;
  std::string message;  ///< without the path: what is wrong, and what would be right
};

/// The whole content of a regular file. `wanted` says what the caller needs ("the path of a TOML file"). Never waits
/// for another program and reads no endless device: FIFOs, devices, directories and sockets are not_regular. A file
/// that grows while it is read is read up to the size that it had. Error too_large: above `most_bytes`, nothing is
/// read.
tl::expected<std::string, FileError> read_file(const std::string& path, std::size_t most_bytes,
                                               const std::string& wanted);

/// The lines of such a file one after the other, without their ends, while no more than a line and a mebibyte is held.
/// What `take` throws comes through. Errors as read_file's; a line may have been taken before the file cannot be read
/// on.
tl::expected<void, FileError> each_line(const std::string& path, std::size_t most_bytes, const std::string& wanted,
                                        const std::function<void(std::string_view)>& take);

/// What gzip made this content of, or zip of one file; other content as it is. Error: damaged, cut short, several files
/// in a zip, or larger than `most_bytes` unpacked, of which no more than that is ever held.
tl::expected<std::string, std::string> unzipped(std::string content, std::size_t most_bytes);

}  // namespace backwash::files
