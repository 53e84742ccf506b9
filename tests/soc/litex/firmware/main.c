/* A VexRiscv sends frames to the core by DMA and prints what comes back, a word per line; `test_litex.py` compares. */

#include <generated/csr.h>
#include <generated/mem.h>
#include <system.h>

#include "codes.h"
#include "dermis_registers.h"

#define MOST_WORDS 4096

static uint32_t sent[TAXELS];
static uint32_t words[MOST_WORDS];

static void put(char byte)
{
	while (uart_txfull_read())
		;
	uart_rxtx_write((uint8_t)byte);
}

static void print(const char *name, uint32_t value)
{
	while (*name)
		put(*name++);
	put(' ');
	for (int digit = 28; digit >= 0; digit -= 4)
		put("0123456789abcdef"[value >> digit & 15]);
	put('\n');
}

static void print_words(const char *name, uint32_t count)
{
	for (uint32_t word = 0; word < count; word++)
		print(name, words[word]);
}

static volatile uint32_t *reg(uint32_t offset)
{
	return (volatile uint32_t *)(DERMIS_BASE + offset);
}

static void send(uint32_t taxels)
{
	dermis_dma_reader_enable_write(0);
	dermis_dma_reader_base_write((uintptr_t)sent);
	dermis_dma_reader_length_write(4 * taxels);
	dermis_dma_reader_enable_write(1);
	while (!dermis_dma_reader_done_read())
		;
}

static void receive_begin(uint32_t count)
{
	dermis_dma_writer_enable_write(0);
	dermis_dma_writer_base_write((uintptr_t)words);
	dermis_dma_writer_length_write(4 * count);
	dermis_dma_writer_enable_write(1);
}

static void receive_end(void)
{
	while (!dermis_dma_writer_done_read())
		;
	/* The channel has written behind the cache. */
	flush_cpu_dcache();
}

int main(void)
{
	uint32_t count = 3 * (*reg(DERMIS_FORCE_TRIPLES_OFFSET) + *reg(DERMIS_STATUS_TRIPLES_OFFSET));

	print("id", *reg(DERMIS_ID_OFFSET));
	print("count", count);
	if (count > MOST_WORDS)
		goto end;

	/* A frame. */
	for (int taxel = 0; taxel < TAXELS; taxel++)
		sent[taxel] = (uint32_t)codes[taxel];
	receive_begin(count);
	send(TAXELS);
	receive_end();
	print_words("right", count);
	print("errors", *reg(DERMIS_ERRORS_OFFSET));

	/* One that ends early has no answer, and the next is right. */
	receive_begin(count);
	send(TAXELS - 1);
	send(TAXELS);
	receive_end();
	print_words("after", count);
	print("errors", *reg(DERMIS_ERRORS_OFFSET));
	*reg(DERMIS_ERRORS_OFFSET) = DERMIS_ERRORS_FRAMING_MASK;

	/* A code that the engine's codes cannot hold. */
	sent[0] = 0x7fffffff;
	receive_begin(count);
	send(TAXELS);
	receive_end();
	print("errors", *reg(DERMIS_ERRORS_OFFSET));
	*reg(DERMIS_ERRORS_OFFSET) = DERMIS_ERRORS_CLIPPED_MASK;
	print("errors", *reg(DERMIS_ERRORS_OFFSET));
	print("frames", *reg(DERMIS_FRAMES_OUT_OFFSET));
end:
	while (!uart_txempty_read())
		;
	sim_finish_finish_write(1);
	return 0;
}
