// Statements that add the light of all lights of the cell of a surface s.
    Cell cell = find_cell(s);
    for (int word = cell.word; word < cell.end; word += 4) {
        uvec4 bits = masks_at(cell, word);
        do {
            for (int n = 0; n < 32 && bits != uvec4(0u); ++n)
                light_surface(s, fetch_light(next_light(word, bits)));
            carry_sums();
        } while (bits != uvec4(0u));  // one pass of this loop if these four words have at most 32 lights
        if ((word & 28) == 28)
            carry_carried();
    }
    close_sums();
