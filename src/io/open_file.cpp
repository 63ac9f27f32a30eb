#include "io/open_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "base/error.h"

namespace pellicle::io {

OpenFile::OpenFile(std::string path, int flags)
    : path_(std::move(path)),
      descriptor_(open(path_.c_str(), flags | O_CLOEXEC, 0666)),
      error_(is_open() ? 0 : errno) {}

OpenFile::~OpenFile() {
  if (is_open()) {
    close(descriptor_);
  }
}

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(error_, other.error_);
  return *this;
}

bool OpenFile::is_at(const std::string& path) const {
  struct stat opened {};
  struct stat there {};
  return is_open() && fstat(descriptor_, &opened) == 0 && stat(path.c_str(), &there) == 0 &&
         opened.st_dev == there.st_dev && opened.st_ino == there.st_ino;
}

std::string OpenFile::text() const {
  std::string all;
  char part[65536];
  while (true) {
    const ssize_t count = pread(descriptor_, part, sizeof part, static_cast<off_t>(all.size()));
    if (count < 0) {
      throw Error(path_ + ": cannot be read: " + std::strerror(errno));
    }
    if (count == 0) {
      return all;
    }
    all.append(part, static_cast<std::size_t>(count));
  }
}

long long OpenFile::size() const {
  struct stat there {};
  if (fstat(descriptor_, &there) != 0) {
    throw Error(path_ + ": cannot be read: " + std::strerror(errno));
  }
  return there.st_size;
}

void OpenFile::append(const std::string& text) {
  const off_t end = lseek(descriptor_, 0, SEEK_END);
  if (end < 0) {
    fail();
  }
  try {
    write(text, end);
  } catch (const Error&) {
    if (ftruncate(descriptor_, end) != 0) {
      // The first fault is the one that is reported.
    }
    throw;
  }
}

void OpenFile::overwrite(const std::string& text) {
  write(text, 0);
  truncate(static_cast<long long>(text.size()));
}

void OpenFile::truncate(long long size) {
  if (ftruncate(descriptor_, static_cast<off_t>(size)) != 0) {
    fail();
  }
}

void OpenFile::write(const std::string& text, long long position) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = pwrite(descriptor_, text.data() + done, text.size() - done,
                                 static_cast<off_t>(position + static_cast<long long>(done)));
    if (count < 0 && errno != EINTR) {
      fail();
    }
    done += count > 0 ? static_cast<std::size_t>(count) : 0;
  }
}

void OpenFile::fail() const {
  throw Error(path_ + ": cannot be written: " + std::strerror(is_open() ? errno : error_));
}

std::string checksum_of(const std::string& text) {
  std::ostringstream sum;
  sum << std::hex << crc32_z(0, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  return sum.str();
}

}  // namespace pellicle::io
