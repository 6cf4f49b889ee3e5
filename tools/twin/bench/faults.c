/* SPDX-License-Identifier: GPL-3.0-or-later
 * Fault switches `name=value` of the bench protocol (README.md), which the models have added. */
#include <stdlib.h>
#include <string.h>

#include "twin.h"

static struct fault_switch *switches;

void fault_switch_add(struct fault_switch *added)
{
	added->next = switches;
	switches = added;
}

/* The number, if it is at most the one that `limit` begins with; else -1. */
static int number_of(const char *limit, const char *value)
{
	char *end;
	long number = strtol(value, &end, 10);

	return end == value || *end || number < 0 || number > atol(limit) ? -1 : (int)number;
}

/* Which of the values it is; -1: none. */
static int choice_of(const char *values, const char *value)
{
	size_t length = strlen(value);

	for (int k = 0; *values; k++) {
		size_t word = strcspn(values, " ");

		if (word == length && !memcmp(values, value, length))
			return k;
		values += word + strspn(values + word, " ");
	}
	return -1;
}

void switch_fault(char *text)
{
	char *value = strchr(text, '=');

	if (!value)
		fail("fault '%s' is not name=value", text);
	*value++ = 0;
	for (struct fault_switch *s = switches; s; s = s->next) {
		int choice = *s->values == '<' ? number_of(s->values + 2, value) : choice_of(s->values, value);
		unsigned before = s->value;

		if (choice < 0 || strcmp(text, s->name))
			continue;
		s->value = (unsigned)choice;
		if (s->changed)
			s->changed(s, before);
		return;
	}
	fail("there is no fault %s=%s; see tools/twin/README.md", text, value);
}
