#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace pellicle {

/// Writes the bytes of an input to a file of this process, and gives its path.
/// @param ending of its name, which names the format
std::string write_input(const std::uint8_t* data, std::size_t size, const std::string& ending);

/// Runs `read`, which may refuse its input by an Error of one line that names the file; anything else is a fault, and
/// ends the process.
/// @param path that the message must begin with
void expect_sound(const std::string& path, void (*read)(const std::string& path));

}  // namespace pellicle

/// What libFuzzer, or run_corpus, calls with each input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
