# A base plate with eight fins made by one statement.
algebraic3d

solid plate = orthobrick (0, 0, 0; 8, 5, 0.6);
solid fin = orthobrick (0.3, 0, 0.3; 0.7, 5, 3);
solid sink = plate or multitranslate (1, 0, 0; 7; fin);

tlo sink -material=aluminium;
