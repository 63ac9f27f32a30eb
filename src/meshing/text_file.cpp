#include "meshing/text_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <utility>

#include "base/error.h"

namespace pellicle::meshing {

namespace {

constexpr std::string_view blanks = " \t\r\v\f";

void split(std::string_view text, std::vector<std::string_view>& words) {
  words.clear();
  for (std::size_t begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(blanks, end);
  }
}

}  // namespace

TextFile::TextFile(const std::string& path, bool comments, std::set<std::string_view> keywords)
    : path_(path), comments_(comments), keywords_(std::move(keywords)) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (stream) {
    content_.resize(static_cast<std::size_t>(stream.tellg()));
    stream.seekg(0).read(content_.data(), static_cast<std::streamsize>(content_.size()));
  }
  if (!stream) {
    throw Error(path + ": cannot be opened for reading");
  }
  // Some editors put a byte order mark in front of a text.
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  next_ = content_.compare(0, mark.size(), mark) == 0 ? mark.size() : 0;
}

/// The next line, without what ends it and without a comment.
std::string_view TextFile::take_line() {
  const std::size_t begin = next_;
  std::size_t end = begin;
  while (end < content_.size() && content_[end] != '\n' && content_[end] != '\r') {
    ++end;
  }
  // Where a carriage return alone has ended the line before, it does so here: a line feed behind it is something else.
  const bool ends_with_both = content_.compare(end, 2, "\r\n") == 0 && (begin == 0 || content_[begin - 1] != '\r');
  next_ = std::min(end + (ends_with_both ? 2 : 1), content_.size());
  ++line_number_;
  const std::string_view line = std::string_view(content_).substr(begin, end - begin);
  refuse_if(line.find('\0') != std::string_view::npos, "a zero byte, expected text");
  return line.substr(0, comments_ ? line.find('#') : std::string_view::npos);
}

bool TextFile::next_line() {
  words_.clear();
  used_ = 0;
  while (words_.empty() && next_ < content_.size()) {
    line_ = take_line();
    while (!keywords_.empty()) {
      const std::size_t last = line_.find_last_not_of(blanks);
      if (last == std::string::npos || line_[last] != '\\') {
        break;
      }
      line_[last] = ' ';
      if (next_ == content_.size()) {
        break;
      }
      const std::size_t next = next_;
      const std::string_view more = take_line();
      split(more, words_);
      if (!words_.empty() && keywords_.count(words_.front()) != 0) {
        next_ = next;
        --line_number_;
        break;
      }
      line_ += more;
    }
    split(line_, words_);
  }
  return !words_.empty();
}

std::string_view TextFile::next_word(const char* expected) {
  if (used_ == words_.size() && !next_line()) {
    throw Error(fmt::format("{}: ends at line {}, expected {}", path_, line_number_, expected));
  }
  return words_[used_++];
}

Eigen::Vector3d TextFile::next_point() {
  Eigen::Vector3d point;
  for (double& coordinate : point) {
    coordinate = next_number("a coordinate");
  }
  return point;
}

double TextFile::number(std::string_view word, const char* expected) const {
  double value = 0;
  const char* begin = word.data() + (word.size() > 1 && word.front() == '+' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, code] = std::from_chars(begin, end, value);
  // A value too small for a double is as good as zero; one too large is an error.
  const bool underflow = code == std::errc::result_out_of_range && std::abs(std::strtod(begin, nullptr)) < 1;
  refuse_if((code != std::errc() && !underflow) || stop != end || !std::isfinite(value),
            "'{}', expected {} (a finite number)", word, expected);
  return value;
}

int TextFile::integer(std::string_view word, const char* expected) const {
  int value = 0;
  const char* begin = word.data() + (word.size() > 1 && word.front() == '+' && word[1] != '-' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, code] = std::from_chars(begin, end, value);
  refuse_if(code == std::errc::result_out_of_range && stop == end, "'{}', expected {} (an integer of at most {})", word,
            expected, std::numeric_limits<int>::max());
  refuse_if(code != std::errc() || stop != end, "'{}', expected {} (an integer)", word, expected);
  return value;
}

int TextFile::count(std::string_view word, const char* expected, std::size_t bytes) const {
  const int value = integer(word, expected);
  refuse_if(value < 0 || static_cast<std::size_t>(value) > content_.size() / bytes,
            "'{}', expected {}, 0 to {} in a file of {} bytes", word, expected, content_.size() / bytes,
            content_.size());
  return value;
}

void TextFile::fail(const std::string& message) const {
  throw Error(fmt::format("{}{}: {}", path_, is_text_ ? fmt::format(":{}", line_number_) : "", message));
}

}  // namespace pellicle::meshing
