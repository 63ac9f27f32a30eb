#pragma once

#include <string>

namespace pellicle {
inline namespace io {

/// A file held open by its descriptor, which knows whether it is still the file at its path. Closed at the end.
class OpenFile {
 public:
  OpenFile() = default;
  /// Tries to open it, see is_open. @param flags of open(2)
  OpenFile(std::string path, int flags);
  ~OpenFile();
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&& other) noexcept;

  bool is_open() const { return descriptor_ >= 0; }
  /// Why it could not be opened, an error number.
  int error() const { return error_; }
  int descriptor() const { return descriptor_; }
  const std::string& path() const { return path_; }

  /// Whether a path leads to it.
  bool is_at(const std::string& path) const;

  /// Bytes. @throws Error
  long long size() const;
  /// The whole text of the file. @throws Error
  std::string text() const;
  /// Adds a text to its end, or nothing of it if that fails. @throws Error
  void append(const std::string& text);
  /// Cuts it to so many bytes. @throws Error
  void truncate(long long size);
  /// Replaces its content by a text. @throws Error
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

}  // namespace io
}  // namespace pellicle
