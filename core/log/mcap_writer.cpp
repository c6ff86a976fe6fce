// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap_writer.hpp"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kChunk = 1u << 20;  // bytes at which one is ended

std::uint32_t crc_of(std::uint32_t before, std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(before, bytes.data(), bytes.size()));
}

void put_text(Bytes& to, std::string_view text) {
  put_little(to, static_cast<std::uint32_t>(text.size()));
  to.insert(to.end(), text.begin(), text.end());
}

/// The entries of a map or an array behind their length in bytes.
void put_entries(Bytes& to, const Bytes& entries) {
  put_little(to, static_cast<std::uint32_t>(entries.size()));
  to.insert(to.end(), entries.begin(), entries.end());
}

Bytes record_of(McapOp op, std::span<const std::uint8_t> content) {
  Bytes record{static_cast<std::uint8_t>(op)};
  put_little(record, std::uint64_t{content.size()});
  record.insert(record.end(), content.begin(), content.end());
  return record;
}

void append(Bytes& to, const Bytes& more) { to.insert(to.end(), more.begin(), more.end()); }

}  // namespace

void McapWriter::Span::add(std::uint64_t t_ns) {
  first_ns = messages == 0 ? t_ns : std::min(first_ns, t_ns);
  last_ns = std::max(last_ns, t_ns);
  ++messages;
}

McapWriter::McapWriter(std::ostream& out, std::string_view library) : out_(out) {
  put(kMcapMagic);
  Bytes header;
  put_text(header, "ros2");
  put_text(header, library);
  put_record(McapOp::header, header);
}

void McapWriter::put(std::span<const std::uint8_t> bytes) {
  out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  crc_ = crc_of(crc_, bytes);
  at_ += bytes.size();
}

void McapWriter::put_record(McapOp op, std::span<const std::uint8_t> content) { put(record_of(op, content)); }

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view type, std::string_view schema) {
  auto known = schemas_.find(type);
  if (known == schemas_.end()) {
    known = schemas_.emplace(type, static_cast<std::uint16_t>(schemas_.size() + 1)).first;
    Bytes content;
    put_little(content, known->second);
    put_text(content, type);
    put_text(content, "ros2msg");
    put_text(content, schema);
    const Bytes record = record_of(McapOp::schema, content);
    append(schema_records_, record);
    append(chunk_, record);
  }
  messages_.push_back(0);
  const auto number = static_cast<std::uint16_t>(messages_.size());
  Bytes content, metadata;
  put_text(metadata, "offered_qos_profiles");  // the profile demands it; empty: those of a reader who asks for none
  put_text(metadata, "");
  put_little(content, number);
  put_little(content, known->second);
  put_text(content, topic);
  put_text(content, "cdr");
  put_entries(content, metadata);
  const Bytes record = record_of(McapOp::channel, content);
  append(channel_records_, record);
  append(chunk_, record);
  return number;
}

void McapWriter::write(std::uint16_t channel, McapTimes times, std::span<const std::uint8_t> cdr) {
  Bytes content;
  content.reserve(22 + cdr.size());
  put_little(content, channel);
  put_little(content, static_cast<std::uint32_t>(messages_[channel - 1u]++));
  put_little(content, times.log_ns);
  put_little(content, times.publish_ns);
  content.insert(content.end(), cdr.begin(), cdr.end());
  places_[channel].push_back({times.log_ns, chunk_.size()});
  append(chunk_, record_of(McapOp::message, content));
  chunk_span_.add(times.log_ns);
  span_.add(times.log_ns);
  if (chunk_.size() >= kChunk) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  Bytes content;
  put_little(content, chunk_span_.first_ns);
  put_little(content, chunk_span_.last_ns);
  put_little(content, std::uint64_t{chunk_.size()});
  put_little(content, crc_of(0, chunk_));
  put_text(content, "");  // not compressed
  put_little(content, std::uint64_t{chunk_.size()});
  append(content, chunk_);
  Chunk chunk{std::exchange(chunk_span_, {}), at_, 0, 0, chunk_.size(), {}};
  put_record(McapOp::chunk, content);
  chunk.length = at_ - chunk.at;
  put_message_index(chunk);
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
}

void McapWriter::put_message_index(Chunk& chunk) {
  const std::uint64_t from = at_;
  for (const auto& [channel, places] : std::exchange(places_, {})) {
    chunk.index_at[channel] = at_;
    Bytes content, entries;
    for (const Place& place : places) {
      put_little(entries, place.t_ns);
      put_little(entries, place.offset);
    }
    put_little(content, channel);
    put_entries(content, entries);
    put_record(McapOp::message_index, content);
  }
  chunk.index_length = at_ - from;
}

McapWriter::Bytes McapWriter::statistics() const {
  Bytes content, counts;
  put_little(content, span_.messages);
  put_little(content, static_cast<std::uint16_t>(schemas_.size()));
  put_little(content, static_cast<std::uint32_t>(messages_.size()));
  put_little(content, std::uint32_t{0});  // attachments
  put_little(content, std::uint32_t{0});  // metadata
  put_little(content, static_cast<std::uint32_t>(chunks_.size()));
  put_little(content, span_.first_ns);
  put_little(content, span_.last_ns);
  for (std::size_t n = 0; n < messages_.size(); ++n) {
    put_little(counts, static_cast<std::uint16_t>(n + 1));
    put_little(counts, messages_[n]);
  }
  put_entries(content, counts);
  return content;
}

std::uint64_t McapWriter::put_summary() {
  Bytes index;
  for (const Chunk& chunk : chunks_) {
    Bytes content, index_at;
    put_little(content, chunk.span.first_ns);
    put_little(content, chunk.span.last_ns);
    put_little(content, chunk.at);
    put_little(content, chunk.length);
    for (const auto& [channel, at] : chunk.index_at) {
      put_little(index_at, channel);
      put_little(index_at, at);
    }
    put_entries(content, index_at);
    put_little(content, chunk.index_length);
    put_text(content, "");
    put_little(content, chunk.size);
    put_little(content, chunk.size);
    append(index, record_of(McapOp::chunk_index, content));
  }
  Bytes offsets;
  const std::pair<McapOp, const Bytes> groups[] = {{McapOp::schema, schema_records_},
                                                   {McapOp::channel, channel_records_},
                                                   {McapOp::chunk_index, index},
                                                   {McapOp::statistics, record_of(McapOp::statistics, statistics())}};
  for (const auto& [op, records] : groups) {
    if (records.empty()) continue;
    Bytes content{static_cast<std::uint8_t>(op)};
    put_little(content, at_);
    put_little(content, std::uint64_t{records.size()});
    append(offsets, record_of(McapOp::summary_offset, content));
    put(records);
  }
  const std::uint64_t offsets_at = at_;
  put(offsets);
  return offsets_at;
}

void McapWriter::finish() {
  end_chunk();
  Bytes end;
  put_little(end, crc_);
  put_record(McapOp::data_end, end);
  crc_ = 0;
  const std::uint64_t summary_at = at_;
  const std::uint64_t offsets_at = put_summary();
  Bytes footer{static_cast<std::uint8_t>(McapOp::footer)};
  put_little(footer, std::uint64_t{8 + 8 + 4});
  put_little(footer, summary_at);
  put_little(footer, offsets_at);
  put_little(footer, crc_of(crc_, footer));
  put(footer);
  put(kMcapMagic);
}

}  // namespace backwash::log
