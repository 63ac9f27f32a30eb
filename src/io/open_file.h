#pragma once

#include <string>
#include <utility>

#include "base/namespaces.h"

namespace pellicle::io {

/// An open file, by its descriptor, so that its replacement at its path can be detected. Closed by the destructor.
class OpenFile {
 public:
  OpenFile() = default;
  /// Tries to open a file (is_open). @param flags of open(2)
  OpenFile(std::string path, int flags);
  ~OpenFile();
  OpenFile(OpenFile&& other) noexcept { *this = std::move(other); }
  OpenFile& operator=(OpenFile&& other) noexcept;

  bool is_open() const { return descriptor_ >= 0; }
  /// Error number of the failure to open.
  int error() const { return error_; }
  int descriptor() const { return descriptor_; }
  const std::string& path() const { return path_; }

  /// Whether a path leads to this file.
  bool is_at(const std::string& path) const;

  /// Size of the file [bytes]. @throws Error
  long long size() const;
  /// The whole text of the file. @throws Error
  std::string text() const;
  /// Appends a text, or no part of it on failure. @throws Error
  void append(const std::string& text);
  /// Cuts the file to a size [bytes]. @throws Error
  void truncate(long long size);
  /// Replaces the content by a text. @throws Error
  void overwrite(const std::string& text);

 private:
  [[noreturn]] void fail() const;
  void write(const std::string& text, long long position);

  std::string path_;
  int descriptor_ = -1;
  int error_ = 0;
};

/// CRC-32 of a text, in hexadecimal digits.
std::string checksum_of(const std::string& text);

}  // namespace pellicle::io
