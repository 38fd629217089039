/// Studies as text: what is refused, where and in which words; texts with bytes damaged.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The message of a study refused as t.toml; empty if it is accepted.
std::string study_refusal(const std::string& text);

/// The study is refused at "t.toml:<place>: " and every one of the words is in the message.
void check_refused(const std::string& text, const std::string& place,
                   const std::vector<std::string>& words);

/// Loaded, or refused in one line with the file's name: nothing else may come of any text.
bool loads_or_is_refused(const std::string& text);

/// So it is with every one of `trials` texts that have bytes changed, inserted or erased.
void check_damaged(const std::string& text, int trials);

/// So it is where any of these values stands at any key from `table` on, or none.
void check_exchanged(const std::string& text, const std::string& table,
                     const std::vector<std::string_view>& values);
