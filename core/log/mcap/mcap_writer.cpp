// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/mcap_writer.hpp"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "core/log/little_endian.hpp"

namespace backwash::log {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Stands where a chunk's head will: metadata without entries, whose name makes it as long.
constexpr std::string_view kOpen = "a chunk that was not ended yet  ";

std::uint32_t crc_of(std::uint32_t before, std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(before, bytes.data(), bytes.size()));
}

void put_text(Bytes& to, std::string_view text) {
  put_little(to, static_cast<std::uint32_t>(text.size()));
  to.insert(to.end(), text.begin(), text.end());
}

void append(Bytes& to, std::span<const std::uint8_t> more) { to.insert(to.end(), more.begin(), more.end()); }

/// The entries of a map or an array behind their length in bytes.
void put_entries(Bytes& to, const Bytes& entries) {
  put_little(to, static_cast<std::uint32_t>(entries.size()));
  append(to, entries);
}

/// Adds a record: its content may follow in part, `more` bytes of it.
void put_record(Bytes& to, McapOp op, const Bytes& content, std::uint64_t more = 0) {
  to.push_back(static_cast<std::uint8_t>(op));
  put_little(to, content.size() + more);
  append(to, content);
}

}  // namespace

void McapWriter::Span::add(std::uint64_t t_ns) {
  first_ns = messages == 0 ? t_ns : std::min(first_ns, t_ns);
  last_ns = std::max(last_ns, t_ns);
  ++messages;
}

McapWriter::McapWriter(std::string_view library) : before_(kMcapMagic.begin(), kMcapMagic.end()) {
  Bytes header;
  put_text(header, "ros2");
  put_text(header, library);
  put_record(before_, McapOp::header, header);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view type, std::string_view schema) {
  auto known = schemas_.find(type);
  if (known == schemas_.end()) {
    known = schemas_.emplace(type, static_cast<std::uint16_t>(schemas_.size() + 1)).first;
    Bytes content, record;
    put_little(content, known->second);
    put_text(content, type);
    put_text(content, "ros2msg");
    put_text(content, schema);
    put_record(record, McapOp::schema, content);
    append(schema_records_, record);
    append(before_, record);
  }
  messages_.push_back(0);
  numbered_.push_back(0);
  const auto number = static_cast<std::uint16_t>(messages_.size());
  Bytes content, metadata, record;
  put_text(metadata, "offered_qos_profiles");  // the profile demands it; empty: those of a reader who asks for none
  put_text(metadata, "");
  put_little(content, number);
  put_little(content, known->second);
  put_text(content, topic);
  put_text(content, "cdr");
  put_entries(content, metadata);
  put_record(record, McapOp::channel, content);
  append(channel_records_, record);
  append(before_, record);
  return number;
}

void McapWriter::write(std::uint16_t channel, McapTimes times, std::span<const std::uint8_t> cdr,
                       std::span<const std::uint8_t> more) {
  if (batch_.empty() && !open_) {
    Bytes open;
    put_text(open, kOpen);
    put_entries(open, {});
    batch_ = before_;
    put_record(batch_, McapOp::metadata, open);
    begin_ = batch_.size();
  }
  places_.push_back({channel, times.log_ns, batch_.size()});
  Bytes content;
  put_little(content, channel);
  put_little(content, static_cast<std::uint32_t>(numbered_[channel - 1u]++));
  put_little(content, times.log_ns);
  put_little(content, times.publish_ns);
  put_record(batch_, McapOp::message, content, cdr.size() + more.size());
  append(batch_, cdr);
  append(batch_, more);
}

bool McapWriter::flush(const McapSink& sink) {
  if (batch_.empty()) return true;
  if (!sink(at_, batch_)) return false;
  if (!open_) {
    crc_ = crc_of(crc_, before_);
    open_ = Chunk{.at = at_ + before_.size()};
    before_.clear();
  }
  for (const Place& place : places_) {
    put_little(index_[place.channel], place.t_ns);
    put_little(index_[place.channel], open_->size + place.offset - begin_);
    open_->span.add(place.t_ns);
    span_.add(place.t_ns);
  }
  at_ += batch_.size();
  open_->crc = crc_of(open_->crc, std::span(batch_).subspan(begin_));
  open_->size += batch_.size() - begin_;
  messages_ = numbered_;
  drop();
  if (open_->size >= kChunk) end_chunk(sink);  // or after the next batch
  return true;
}

void McapWriter::drop() {
  numbered_ = messages_;
  batch_.clear();
  begin_ = 0;
  places_.clear();
}

McapWriter::Bytes McapWriter::head_of(const Chunk& chunk) const {
  Bytes content, head;
  put_little(content, chunk.span.first_ns);
  put_little(content, chunk.span.last_ns);
  put_little(content, chunk.size);
  put_little(content, chunk.crc);
  put_text(content, "");  // not compressed
  put_little(content, chunk.size);
  put_record(head, McapOp::chunk, content, chunk.size);
  return head;
}

bool McapWriter::end_chunk(const McapSink& sink) {
  const Bytes head = head_of(*open_);
  if (!sink(open_->at, head)) return false;
  crc_ = static_cast<std::uint32_t>(::crc32_combine(crc_of(crc_, head), open_->crc, static_cast<z_off_t>(open_->size)));
  for (const auto& [channel, entries] : std::exchange(index_, {})) {
    open_->index_at[channel] = at_ + before_.size();
    Bytes content;
    put_little(content, channel);
    put_entries(content, entries);
    put_record(before_, McapOp::message_index, content);
  }
  open_->index_length = before_.size();
  chunks_.push_back(std::move(*open_));
  open_.reset();
  return true;
}

McapWriter::Bytes McapWriter::statistics() const {
  Bytes content, counts, record;
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
  put_record(record, McapOp::statistics, content);
  return record;
}

McapWriter::Bytes McapWriter::end_of_file() const {
  Bytes bytes = before_, end;
  put_little(end, crc_of(crc_, before_));
  put_record(bytes, McapOp::data_end, end);
  const std::size_t summary = bytes.size();
  Bytes chunk_index, offsets;
  for (const Chunk& chunk : chunks_) {
    Bytes content, index_at;
    put_little(content, chunk.span.first_ns);
    put_little(content, chunk.span.last_ns);
    put_little(content, chunk.at);
    put_little(content, head_of(chunk).size() + chunk.size);
    for (const auto& [channel, at] : chunk.index_at) {
      put_little(index_at, channel);
      put_little(index_at, at);
    }
    put_entries(content, index_at);
    put_little(content, chunk.index_length);
    put_text(content, "");
    put_little(content, chunk.size);
    put_little(content, chunk.size);
    put_record(chunk_index, McapOp::chunk_index, content);
  }
  const std::pair<McapOp, const Bytes> groups[] = {{McapOp::schema, schema_records_},
                                                   {McapOp::channel, channel_records_},
                                                   {McapOp::chunk_index, chunk_index},
                                                   {McapOp::statistics, statistics()}};
  for (const auto& [op, records] : groups) {
    if (records.empty()) continue;
    Bytes content{static_cast<std::uint8_t>(op)};
    put_little(content, at_ + bytes.size());
    put_little(content, std::uint64_t{records.size()});
    put_record(offsets, McapOp::summary_offset, content);
    append(bytes, records);
  }
  const std::uint64_t offsets_at = at_ + bytes.size();
  append(bytes, offsets);
  Bytes places;
  put_little(places, at_ + summary);
  put_little(places, offsets_at);
  put_record(bytes, McapOp::footer, places, sizeof(std::uint32_t));
  put_little(bytes, crc_of(0, std::span(bytes).subspan(summary)));
  append(bytes, kMcapMagic);
  return bytes;
}

bool McapWriter::finish(const McapSink& sink) {
  return flush(sink) && (!open_ || end_chunk(sink)) && sink(at_, end_of_file());
}

}  // namespace backwash::log
